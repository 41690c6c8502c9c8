//! Options as the reference's tools read them: in order, with one or two dashes, each followed by a fixed
//! number of words. Some have settings of their own: `--param:type=float x 1`.

/// An option that a tool knows.
pub(super) struct ToolOption {
    /// Its name without dashes.
    pub(super) name: &'static str,
    /// The number of words after it.
    pub(super) words: usize,
    /// Its description for `--help`; empty if the option is accepted but has no effect here.
    pub(super) help: &'static str,
}

/// A word of the command line, or an option with its words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// An option.
    Option {
        name: &'static str,
        /// Settings after colons, `type=float`.
        settings: Vec<(String, String)>,
        words: Vec<String>,
    },
    /// Any other word.
    Word(String),
}

/// Reads a command line.
///
/// # Errors
/// What is wrong with it, in words.
pub(super) fn parse(tool: &str, args: &[String], known: &[ToolOption]) -> Result<Vec<Item>, String> {
    let mut items = Vec::new();
    let mut rest = args.iter();
    while let Some(arg) = rest.next() {
        let Some(text) = arg.strip_prefix("--").or_else(|| arg.strip_prefix('-')).filter(|t| !t.is_empty())
        else {
            items.push(Item::Word(arg.clone()));
            continue;
        };
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or("");
        let option = known
            .iter()
            .find(|k| k.name == name)
            .ok_or_else(|| format!("{tool}: unknown option \"{arg}\" ({tool} --help lists what there is)"))?;
        let setting = |text: &str| {
            let (key, value) = text.split_once('=').unwrap_or((text, "1"));
            (key.to_string(), value.to_string())
        };
        let settings = parts.map(setting).collect();
        let words: Vec<String> = rest.by_ref().take(option.words).cloned().collect();
        if words.len() < option.words {
            return Err(format!("{tool}: {arg} needs {} more words, not {}", option.words, words.len()));
        }
        items.push(Item::Option { name: option.name, settings, words });
    }
    Ok(items)
}

/// The help text of the options.
pub(super) fn help(usage: &str, known: &[ToolOption]) -> String {
    let mut text = format!("{usage}\n\nOptions:\n");
    for ToolOption { name, words, help } in known.iter().filter(|k| !k.help.is_empty()) {
        let dashes = if name.len() <= 2 { "-" } else { "--" };
        text += &format!("  {:<28} {help}\n", format!("{dashes}{name}{}", " ARG".repeat(*words)));
    }
    let quiet: Vec<&str> = known.iter().filter(|k| k.help.is_empty()).map(|k| k.name).collect();
    text += "\nAs oslrun: --limit NAME=N, --max-time SECONDS, --max-memory MIB (docs/limits.md)\n";
    text += &format!("\nAccepted and without effect: {}\n", quiet.join(" "));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [ToolOption; 2] =
        [ToolOption { name: "g", words: 2, help: "" }, ToolOption { name: "param", words: 2, help: "" }];

    #[test]
    fn one_dash_or_two() {
        let args: Vec<String> =
            ["-g", "4", "-4", "a", "--param:type=float:x", "f", "1"].map(String::from).into();
        let items = parse("tool", &args, &KNOWN).expect("a command line");
        let words = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(items[0], Item::Option { name: "g", settings: Vec::new(), words: words(&["4", "-4"]) });
        assert_eq!(items[1], Item::Word("a".into()));
        let settings = vec![("type".into(), "float".into()), ("x".into(), "1".into())];
        assert_eq!(items[2], Item::Option { name: "param", settings, words: words(&["f", "1"]) });
    }

    #[test]
    fn what_is_wrong() {
        assert!(
            parse("tool", &["--foo".into()], &KNOWN).is_err_and(|e| e.contains("unknown option \"--foo\""))
        );
        assert!(parse("tool", &["-g".into(), "1".into()], &KNOWN).is_err_and(|e| e.contains("2 more words")));
    }
}
