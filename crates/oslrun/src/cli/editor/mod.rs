//! `oslrun lsp`: the language server, over the standard streams.
//!
//! What an editor shows comes from the crate osl-editor. This room has the loop and its queue ([`serve`]),
//! the open texts and the answers to requests ([`session`]), the files and their addresses ([`desk`]), the
//! settings, and the values of a probed pixel ([`probe`]).

mod desk;
mod probe;
mod serve;
mod session;
mod settings;

use crate::cli::options::reading::{LintArgs, ReadArgs};
use clap::Args;
use lsp_server::Connection;
use osl_job::Failure;
use settings::Settings;

/// How sources are read, and which warnings are shown. Settings of the editor add to these options.
#[derive(Debug, Args)]
pub(super) struct LspArgs {
    /// Talk over the standard streams. There is no other way; some editors give this option.
    #[arg(long)]
    stdio: bool,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
}

/// Serves an editor until it ends the connection.
pub(super) fn lsp(args: &LspArgs) -> Result<(), Failure> {
    let settings = Settings::new(args.read.reading(), args.lints.lints());
    let (connection, threads) = Connection::stdio();
    let result = serve::serve(&connection, settings);
    // The thread that writes ends when nothing more can be sent.
    drop(connection);
    let joined =
        threads.join().map_err(|why| Failure::new(format!("the connection to the editor broke: {why}")));
    result.and(joined)
}
