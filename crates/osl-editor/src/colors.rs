//! Colors that are written as numbers, for the color picker of an editor.

use crate::page::Page;
use crate::scan::Kind;
use gen_lsp_types::{Color, ColorInformation, ColorPresentation, Range, TextEdit};

impl Page {
    /// The constructors `color(r, g, b)` and `color(x)` of numbers from 0 to 1. The picker shows the numbers
    /// as they are: no color space is converted.
    pub fn colors(&self) -> Vec<ColorInformation> {
        let scan = self.scan();
        let mut list = Vec::new();
        for (index, token) in scan.tokens.iter().enumerate() {
            if token.kind != Kind::Word || self.token(token) != "color" || self.word(Some(index + 1)) != "(" {
                continue;
            }
            let Some(close) = scan.get(index + 1).and_then(|open| open.partner) else { continue };
            let words: Vec<&str> = (index + 2..close).map(|i| self.word(Some(i))).collect();
            let number = |text: &str| text.trim_end_matches(['f', 'F']).parse::<f32>().ok();
            let numbers = match words[..] {
                [grey] => number(grey).map(|x| [x; 3]),
                [r, ",", g, ",", b] => number(r).zip(number(g)).zip(number(b)).map(|((r, g), b)| [r, g, b]),
                _ => None,
            };
            let in_range = |numbers: &[f32; 3]| numbers.iter().all(|x| (0.0..=1.0).contains(x));
            if let Some([r, g, b]) = numbers.filter(in_range)
                && let Some(close) = scan.get(close)
            {
                list.push(ColorInformation::new(
                    self.text.range(token.start, close.end),
                    Color::new(r, g, b, 1.0),
                ));
            }
        }
        list
    }
}

/// How a picked color is written.
pub fn presentations(color: &Color, range: Range) -> Vec<ColorPresentation> {
    let number = |x: f32| {
        let text = format!("{x:.3}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text.is_empty() { "0".to_string() } else { text.to_string() }
    };
    let label = format!("color({}, {}, {})", number(color.red), number(color.green), number(color.blue));
    let edit = TextEdit::new(range, label.clone());
    vec![ColorPresentation { label, text_edit: Some(edit), additional_text_edits: None }]
}
