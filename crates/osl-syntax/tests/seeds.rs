//! The published seed shaders: each parses or is repaired, and the repaired form is the recorded one.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{codes, lenient, read, strict};
use osl_syntax::repair::repair;
use osl_syntax::{NoFiles, Options, print};

const SEEDS: [&str; 4] =
    ["chaosmosaic.osl", "Cobbled.repaired.osl", "flakes.repaired.osl", "sprinkles.repaired.osl"];

#[test]
fn tokens_of_the_seeds() {
    for name in SEEDS {
        let parsed = strict(&read(&format!("tests/data/seeds/{name}")));
        assert_eq!(codes(&parsed), [""; 0], "{name}");
        insta::assert_snapshot!(format!("tokens-{name}"), print::tokens(&parsed.tokens, &parsed.sources));
    }
}

#[test]
fn trees_of_the_seeds() {
    for name in SEEDS {
        let parsed = strict(&read(&format!("tests/data/seeds/{name}")));
        insta::assert_snapshot!(format!("ast-{name}"), print::ast(&parsed.ast));
    }
}

#[test]
fn as_published_they_mean_the_same_with_a_warning() {
    for (published, repaired, quirks) in [
        ("osl/chaosmosaic.osl", "chaosmosaic.osl", vec![]),
        ("osl/Cobbled.osl", "Cobbled.repaired.osl", vec!["W0101"]),
        ("osl/flakes.osl", "flakes.repaired.osl", vec!["W0102"; 3]),
    ] {
        let parsed = lenient(&read(published));
        assert_eq!(codes(&parsed), quirks, "{published}");
        assert!(!parsed.has_errors());
        let wanted = strict(&read(&format!("tests/data/seeds/{repaired}")));
        assert_eq!(print::ast(&parsed.ast), print::ast(&wanted.ast), "{published}");
        assert_eq!(strict(&read(published)).has_errors(), !quirks.is_empty(), "{published}");
    }
}

#[test]
fn sprinkles_as_published_is_explained_and_not_guessed() {
    let parsed = lenient(&read("osl/sprinkles.osl"));
    assert_eq!(codes(&parsed), ["E0111", "E0110", "E0111"]);
    assert_eq!(parsed.diagnostics.iter().map(|d| d.fixes.len()).collect::<Vec<_>>(), [1, 0, 0]);
}

#[test]
fn sprinkles_repaired_means_what_it_meant() {
    let text = read("osl/sprinkles.osl");
    let found = repair("sprinkles.osl", &text, &NoFiles, &Options::default()).unwrap();
    insta::assert_snapshot!("sprinkles-repaired-text", found.text);
    let wanted = strict(&read("tests/data/seeds/sprinkles.repaired.osl"));
    let parsed = strict(&found.text);
    assert_eq!(codes(&parsed), [""; 0]);
    assert_eq!(print::ast(&parsed.ast), print::ast(&wanted.ast));
}
