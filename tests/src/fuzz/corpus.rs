//! The inputs that are worth mutating: the seeds of a door, and inputs with new kinds of outcomes.

use super::mutate::{Random, mutate};
use crate::doors::Door;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Maximum number of inputs; then new ones replace old ones.
const MAX_INPUTS: usize = 4096;

/// The inputs of one door.
pub struct Corpus {
    door: &'static Door,
    inputs: Vec<Vec<u8>>,
    /// The outcomes so far.
    known: HashSet<u64>,
    /// The folder for new inputs, if any.
    folder: Option<PathBuf>,
    random: Random,
}

impl Corpus {
    /// A corpus with the seeds of a door and the inputs of earlier runs in `folder`.
    pub fn new(door: &'static Door, seed: u64, folder: Option<&Path>) -> Corpus {
        let mut inputs: Vec<Vec<u8>> = (door.seeds)();
        inputs.retain(|input| input.len() <= door.max_len);
        let mut kept: Vec<PathBuf> = folder
            .and_then(|folder| std::fs::read_dir(folder).ok())
            .map(|list| list.filter_map(|entry| Some(entry.ok()?.path())).collect())
            .unwrap_or_default();
        kept.sort();
        inputs.extend(kept.iter().filter_map(|path| std::fs::read(path).ok()));
        if inputs.is_empty() {
            inputs.push(Vec::new());
        }
        let random = Random::new(seed ^ crate::doors::hash(door.name.as_bytes()));
        Corpus { door, inputs, known: HashSet::new(), folder: folder.map(Path::to_path_buf), random }
    }

    /// How many inputs there are.
    pub fn len(&self) -> usize {
        self.inputs.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.inputs.is_empty()
    }

    /// The next input to try: at first, every second one is an unchanged seed; all others are mutated.
    pub fn input(&mut self, number: u64) -> Vec<u8> {
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
    pub fn note(&mut self, input: &[u8], came_to: u64) {
        if !self.known.insert(came_to) || self.inputs.iter().any(|have| have == input) {
            return;
        }
        if let Some(folder) = &self.folder {
            let name = format!("{:016x}", crate::doors::hash(input));
            // The corpus helps later runs; this run continues without it.
            let _ = std::fs::create_dir_all(folder);
            let _ = std::fs::write(folder.join(name), input);
        }
        if self.inputs.len() < MAX_INPUTS {
            self.inputs.push(input.to_vec());
        } else {
            let at = self.random.below(MAX_INPUTS);
            self.inputs[at] = input.to_vec();
        }
    }
}
