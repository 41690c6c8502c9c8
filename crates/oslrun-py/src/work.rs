//! Work without the interpreter's lock: on all cores, until Python has a signal such as Ctrl-C.

use osl::Cancel;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::mem::forget;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often Python is asked for signals.
const PERIOD: Duration = Duration::from_millis(50);
/// Bytes of the stack of a thread, as in the command: nested code is compiled recursively.
const STACK: usize = 8 << 20;

/// The threads of this process, with its number: those of a parent do not exist in a child of `fork`.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

fn pool() -> PyResult<Arc<ThreadPool>> {
    let own = std::process::id();
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*kept
        && *process == own
    {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().stack_size(STACK).build();
    let pool = pool.map_err(|why| PyRuntimeError::new_err(format!("cannot start threads: {why}")))?;
    let pool = Arc::new(pool);
    // Dropping the parent's would wait for its threads.
    forget(kept.replace((own, pool.clone())));
    Ok(pool)
}

/// Does work on the threads of the process, without the interpreter's lock. If Python has a signal whose
/// handler raises, the work is cancelled and the exception is returned.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce(&Cancel) -> T + Send) -> PyResult<T> {
    let cancel = Cancel::new();
    if rayon::current_thread_index().is_some() {
        // A service of a running shader asks for more: a thread that waits could be the last one.
        return Ok(py.detach(|| work(&cancel)));
    }
    let pool = pool()?;
    let mut signal = Ok(());
    let result = py.detach(|| {
        let (send, receive) = channel();
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                let _ = send.send(work(&cancel));
            });
            loop {
                match receive.recv_timeout(PERIOD) {
                    Ok(result) => return Some(result),
                    Err(RecvTimeoutError::Disconnected) => return None,
                    Err(RecvTimeoutError::Timeout) => {
                        signal = Python::attach(|py| py.check_signals());
                        if signal.is_err() {
                            cancel.cancel();
                            return receive.recv().ok();
                        }
                    }
                }
            }
        })
    });
    signal?;
    result.ok_or_else(|| PyRuntimeError::new_err("the work ended without a result"))
}
