//! The limits of `running`.

use crate::{Tripped, shader};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[("running.trace", trace)];

fn trace(row: &Row) {
    let folder = shader("shader a(output float o = 0) { for (int i = 0; i < 100; i++) o += sin(u + i); }");
    let args = ["explain", "a.osl", "--at", "0,0", "-g", "2x2"];
    assert!(!folder.run(&args).out.contains(row.error));
    let limited = folder.run(&[&args[..], &["--limit", "running.trace=50"]].concat());
    assert!(limited.out.contains(row.error), "{}: {}", row.name, limited.out);
}
