//! Runs fuzzing processes: a parent starts one for each thread and door.
//!
//! An input may end its process, by a stack overflow or a failed allocation, and memory can be measured only
//! for a whole process. A process records each input before it runs it, so that the parent finds the one that
//! ended it.

use super::drive::{Bounds, Tally, Until, Wrong, drive};
use super::measure;
use crate::doors::{self, Door};
use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The fuzzing job.
#[derive(Clone, Debug)]
pub struct Job {
    /// The doors.
    pub doors: Vec<&'static Door>,
    /// The duration for all doors together.
    pub until: Until,
    /// The seed of all changes.
    pub seed: u64,
    /// Number of parallel processes.
    pub threads: usize,
    /// The folder for corpora and failing inputs.
    pub folder: PathBuf,
    /// The limits of an execution.
    pub bounds: Bounds,
}

/// The first word of the command line of a worker process: after it come the door, the seed, the duration,
/// and the folder.
pub const WORKER: &str = "--worker";

/// Runs a job; `told` receives a line for each door and one for each failing input. True if no input failed.
pub fn run(job: &Job, told: &mut (dyn FnMut(&str) + Send)) -> bool {
    let told = Mutex::new(told);
    let tell = |line: &str| {
        if let Ok(mut told) = told.lock() {
            told(line);
        }
    };
    tell(&format!(
        "{:<12} {:>11} {:>9} {:>9} {:>9} {:>7} {:>6}",
        "door", "executions", "a second", "worst s", "worst MB", "corpus", "wrong"
    ));
    let share = |threads: usize| match job.until {
        Until::Runs(runs) => Until::Runs(runs.div_ceil((job.doors.len() * threads) as u64)),
        Until::Time(time) => Until::Time(time / job.doors.len() as u32),
    };
    let mut all = Tally::default();
    let mut failed = 0;
    for door in &job.doors {
        let until = share(job.threads);
        let began = Instant::now();
        let results: Vec<(Tally, usize)> = std::thread::scope(|scope| {
            let worker = |number: usize| worker(job, door, until, number, &tell);
            let running: Vec<_> = (0..job.threads).map(|n| scope.spawn(move || worker(n))).collect();
            running.into_iter().filter_map(|thread| thread.join().ok()).collect()
        });
        let mut sum = Tally::default();
        let wrong: usize = results.iter().map(|(_, wrong)| wrong).sum();
        for (tally, _) in &results {
            add(&mut sum, tally);
        }
        tell(&line(door.name, &sum, began.elapsed(), wrong));
        add(&mut all, &sum);
        failed += wrong;
    }
    tell(&line("all", &all, Duration::from_secs_f64(all.seconds / job.threads as f64), failed));
    failed == 0
}

fn add(sum: &mut Tally, more: &Tally) {
    sum.executions += more.executions;
    sum.seconds += more.seconds;
    sum.worst = sum.worst.max(more.worst);
    sum.megabytes = sum.megabytes.max(more.megabytes);
    sum.corpus = sum.corpus.max(more.corpus);
}

fn line(name: &str, tally: &Tally, time: Duration, wrong: usize) -> String {
    let rate = tally.executions as f64 / time.as_secs_f64().max(1e-3);
    format!(
        "{name:<12} {:>11} {rate:>9.0} {:>9.2} {:>9.0} {:>7} {wrong:>6}",
        tally.executions, tally.worst, tally.megabytes, tally.corpus
    )
}

/// Maximum number of processes that a thread starts for one door, since several inputs may end their process.
const MAX_STARTS: u64 = 8;

/// Runs processes for a door until one completes; returns their tally and the number of failing inputs.
fn worker(job: &Job, door: &Door, until: Until, number: usize, tell: &dyn Fn(&str)) -> (Tally, usize) {
    let (mut sum, mut wrong) = (Tally::default(), 0);
    let started = Instant::now();
    for start in 0..MAX_STARTS {
        let seed = job.seed.wrapping_add((number as u64) << 32).wrapping_add(start << 48);
        let left = match until {
            Until::Runs(runs) => Until::Runs(runs.saturating_sub(sum.executions)),
            Until::Time(time) => Until::Time(time.saturating_sub(started.elapsed())),
        };
        let name = format!("{}-{number}", door.name);
        let Ok(mut child) = spawn(job, door, seed, left, &name) else {
            tell(&format!("cannot start a process for {}", door.name));
            return (sum, wrong + 1);
        };
        let mut text = String::new();
        if let Some(out) = &mut child.stdout {
            let _ = out.read_to_string(&mut text);
        }
        let status = child.wait();
        let failures = text.lines().filter_map(|line| line.strip_prefix("wrong "));
        for failure in failures {
            wrong += 1;
            tell(failure);
        }
        if let Some(tally) = text.lines().find_map(|line| line.strip_prefix("tally ").and_then(read_tally)) {
            add(&mut sum, &tally);
            break;
        }
        wrong += 1;
        let current = job.folder.join("current").join(&name);
        let input = fs::read(&current).unwrap_or_default();
        let why = status.map_or_else(|e| e.to_string(), |status| status.to_string());
        tell(&keep(&job.folder, door, &input, &format!("the process ended: {why}")));
    }
    (sum, wrong)
}

fn spawn(job: &Job, door: &Door, seed: u64, until: Until, name: &str) -> std::io::Result<Child> {
    let until = match until {
        Until::Runs(runs) => format!("runs={runs}"),
        Until::Time(time) => format!("time={}", time.as_secs_f64()),
    };
    let bounds = format!("{},{}", job.bounds.seconds, job.bounds.megabytes);
    Command::new(std::env::current_exe()?)
        .args([WORKER, door.name, &seed.to_string(), &until, &bounds])
        .arg(&job.folder)
        .arg(name)
        // Each door runs on one thread; a thread pool in every process would only slow down the others.
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
}

/// Stores a failing input in the folder; returns a line with the file and the reason.
fn keep(folder: &Path, door: &Door, input: &[u8], why: &str) -> String {
    let failing = folder.join("failing");
    let name = format!("{}-{:016x}", door.name, doors::hash(input));
    let kept = fs::create_dir_all(&failing)
        .and_then(|()| fs::write(failing.join(&name), input))
        .and_then(|()| fs::write(failing.join(format!("{name}.why")), why));
    let first = why.lines().take(2).collect::<Vec<_>>().join(" ");
    match kept {
        Ok(()) => format!("{}: {first:.300}", failing.join(name).display()),
        Err(error) => format!("{name} cannot be kept ({error}): {first:.300}"),
    }
}

fn read_tally(text: &str) -> Option<Tally> {
    let mut words = text.split_whitespace();
    Some(Tally {
        executions: words.next()?.parse().ok()?,
        seconds: words.next()?.parse().ok()?,
        worst: words.next()?.parse().ok()?,
        megabytes: words.next()?.parse().ok()?,
        corpus: words.next()?.parse().ok()?,
    })
}

/// Seconds after which an execution counts as hanging, and the process ends itself.
const HANGS: u64 = 120;

/// Maximum number of failing inputs that a process stores: a door that always fails would fill the disk.
const MAX_KEPT: usize = 20;

/// The work of a worker process, with the words after [`WORKER`]. Its output is for the parent.
///
/// # Errors
/// The words do not come from a parent.
pub fn work(args: &[String], out: &mut dyn Write) -> Result<(), String> {
    let [door, seed, until, bounds, folder, name] = args else { return Err("six words".to_string()) };
    let door = doors::find(door).ok_or("a door")?;
    let seed = seed.parse().map_err(|_| "a seed")?;
    let until = match until.split_once('=') {
        Some(("runs", n)) => Until::Runs(n.parse().map_err(|_| "runs")?),
        Some(("time", t)) => Until::Time(Duration::from_secs_f64(t.parse().map_err(|_| "time")?)),
        _ => return Err("how long".to_string()),
    };
    let (seconds, megabytes) = bounds.split_once(',').ok_or("bounds")?;
    let bounds = Bounds {
        seconds: seconds.parse().map_err(|_| "seconds")?,
        megabytes: megabytes.parse().map_err(|_| "megabytes")?,
    };
    // Doors may change the working directory.
    let folder = fs::canonicalize(folder).map_err(|e| e.to_string())?;
    let current = folder.join("current");
    fs::create_dir_all(&current).map_err(|e| e.to_string())?;
    let mut noted = fs::File::create(current.join(name)).map_err(|e| e.to_string())?;
    std::thread::spawn(watch);
    let mut lines = String::new();
    let mut kept = 0;
    measure::forget_peak();
    let mut before = |input: &[u8]| {
        BEGUN.fetch_add(1, Ordering::Relaxed);
        // If the note fails, an input that ends the process is not found; everything else continues.
        let _ = noted.seek(SeekFrom::Start(0)).and_then(|_| noted.write_all(input));
        let _ = noted.set_len(input.len() as u64);
    };
    let mut wrong = |input: &[u8], what: Wrong| {
        kept += 1;
        if kept <= MAX_KEPT {
            let _ = writeln!(lines, "wrong {}", keep(&folder, door, input, &what.to_string()));
        }
    };
    let corpus = folder.join("corpus").join(door.name);
    let tally = drive(door, (seed, until, bounds), Some(&corpus), &mut before, &mut wrong);
    let Tally { executions, seconds, worst, megabytes, corpus } = tally;
    let _ = writeln!(lines, "tally {executions} {seconds} {worst} {megabytes} {corpus}");
    out.write_all(lines.as_bytes()).map_err(|e| e.to_string())
}

/// Number of started executions.
static BEGUN: AtomicU64 = AtomicU64::new(0);

/// Ends the process if one execution hangs.
fn watch() {
    let (mut last, mut since) = (0, Instant::now());
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let now = BEGUN.load(Ordering::Relaxed);
        if now != last {
            (last, since) = (now, Instant::now());
        } else if now > 0 && since.elapsed() > Duration::from_secs(HANGS) {
            std::process::exit(42);
        }
    }
}
