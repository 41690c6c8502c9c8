//! Runs inputs of one door in sequence, on one thread.

use super::mutate::{Random, mutate};
use crate::doors::{Door, hash};
use std::cell::RefCell;
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, Once, PoisonError};
use std::time::Instant;

/// The most seconds of processor time that an input may take.
const SECONDS: f64 = 5.0;

/// The failure of an input.
#[derive(Clone, Debug, PartialEq)]
pub enum Wrong {
    /// The door panics, with these words.
    Panic(String),
    /// It takes too many seconds of processor time.
    Slow(f64),
}

impl std::fmt::Display for Wrong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Wrong::Panic(why) => write!(f, "panic: {why}"),
            Wrong::Slow(seconds) => write!(f, "slow: {seconds:.1} s"),
        }
    }
}

/// Runs a door on its seeds and on mutations of them, `door.runs` inputs in all. `wrong` receives each input
/// that fails. Returns the longest time in seconds.
pub fn drive(door: &'static Door, seed: u64, wrong: &mut dyn FnMut(&[u8], Wrong)) -> f64 {
    let mut corpus = Corpus::new(door, seed);
    let mut worst = 0.0_f64;
    for number in 0..door.runs {
        let input = corpus.input(number);
        let processor = processor_seconds();
        let began = Instant::now();
        let result = quietly(|| (door.enter)(&input));
        let seconds = began.elapsed().as_secs_f64();
        // On a busy machine an execution takes longer, but does not cost more.
        let seconds = match (processor, processor_seconds()) {
            (Some(before), Some(after)) if seconds > 0.1 => seconds.min(after - before),
            _ => seconds,
        };
        worst = worst.max(seconds);
        match result {
            Err(why) => wrong(&input, Wrong::Panic(why)),
            Ok(_) if seconds > SECONDS => wrong(&input, Wrong::Slow(seconds)),
            Ok(came_to) => corpus.note(input, came_to),
        }
    }
    worst
}

/// The seeds of a door, and inputs with new outcomes, which are worth changing again.
struct Corpus {
    door: &'static Door,
    inputs: Vec<Vec<u8>>,
    known: HashSet<u64>,
    random: Random,
}

impl Corpus {
    fn new(door: &'static Door, seed: u64) -> Corpus {
        let mut inputs: Vec<Vec<u8>> = (door.seeds)();
        inputs.retain(|input| input.len() <= door.max_len);
        if inputs.is_empty() {
            inputs.push(Vec::new());
        }
        Corpus { door, inputs, known: HashSet::new(), random: Random::new(seed ^ hash(door.name.as_bytes())) }
    }

    /// The next input to try: at first, every second one is an unchanged seed; all others are mutated.
    fn input(&mut self, number: u64) -> Vec<u8> {
        let seed = number.is_multiple_of(2).then(|| self.inputs.get(usize::try_from(number / 2).ok()?));
        if let Some(Some(input)) = seed {
            return input.clone();
        }
        let Corpus { random, inputs, door, .. } = self;
        if door.is_choices && random.below(2) == 0 {
            let len = 1 + random.below(door.max_len);
            let seed = random.number();
            return crate::generate::noise_bytes(seed, len);
        }
        let of = |random: &mut Random| random.pick(inputs).cloned().unwrap_or_default();
        let (input, other) = (of(random), of(random));
        mutate(random, &input, &other, door.words, door.max_len)
    }

    /// Keeps an input if its outcome is new.
    fn note(&mut self, input: Vec<u8>, came_to: u64) {
        if self.known.insert(came_to) && !self.inputs.contains(&input) {
            self.inputs.push(input);
        }
    }
}

/// Processor time in seconds that all threads of this process have used, where the system says it as Linux
/// does.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may contain anything, come the fields from 3 on: user and system time are 14 and
    // 15, in ticks of 10 ms.
    let rest = text.get(text.rfind(')')? + 1..)?;
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

thread_local! {
    /// Whether this thread is in a door, and the message of a panic there.
    static WITHIN: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// The message of the last panic on a thread outside of any door, which works for a door.
static ELSEWHERE: Mutex<String> = Mutex::new(String::new());

/// Runs a function; returns the message if it panics, without printing it.
fn quietly(run: impl FnOnce() -> u64) -> Result<u64, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let is_within = WITHIN
                .with_borrow_mut(|words| words.as_mut().map(|words| *words = info.to_string()).is_some());
            if !is_within {
                *ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string();
                usual(info);
            }
        }));
    });
    WITHIN.set(Some(String::new()));
    let result = catch_unwind(AssertUnwindSafe(run));
    let words = WITHIN.take().filter(|words| !words.is_empty());
    result.map_err(|_| {
        words.unwrap_or_else(|| ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner).clone())
    })
}
