//! Formats values by a format string with the conversions of C's `printf`, where one conversion prints a
//! whole triple, matrix or array, its numbers separated by blanks. Printed text follows the reference's
//! library where that differs from C: a precision does not switch zero padding off, and zeros fill on
//! whichever side has room.

use crate::ir::Const;

/// The ways in which the language formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flavour {
    /// `printf`, `error`, `warning`, `fprintf`: strings are aligned to the left, and `%%` is a percent sign.
    /// With the flag `0`, ints have no precision, and all text is padded with zeros; a `.` without digits is
    /// not a precision.
    Print,
    /// `format`: strings are aligned to the right unless flagged, `%%` is a percent sign, infinity is `Inf`,
    /// and octals have no sign.
    Format,
    /// `format` of literals, which the reference executes while it optimises: as `Format`, but `%%` stays,
    /// and octals have a sign.
    Folded,
}

/// The value of one conversion, or the elements of an array.
#[derive(Clone, Debug)]
pub enum Value {
    /// Numbers and strings.
    Consts(Vec<Const>),
    /// Finished text, such as that of a closure.
    Ready(String),
}

/// The text, cut after `most` bytes. Conversions without a value print nothing; values without a conversion
/// are dropped.
pub fn format(text: &str, values: &[Value], flavour: Flavour, most: u64) -> String {
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let mut out = String::new();
    let mut values = values.iter();
    let mut rest = text;
    while let Some(at) = rest.find('%') {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        if let Some(behind) = rest.strip_prefix("%%") {
            out.push_str(if flavour == Flavour::Folded { "%%" } else { "%" });
            rest = behind;
            continue;
        }
        let Some(end) = rest.find(|c| CONVERSIONS.contains(c)) else { break };
        let spec = Spec::parse(&rest[1..=end], flavour);
        rest = &rest[end + 1..];
        match values.next() {
            Some(Value::Ready(text)) => spec.string(text, flavour, &mut out),
            Some(Value::Consts(consts)) => {
                let mut first = true;
                for value in consts {
                    // The rest will be cut off.
                    if out.len() > most {
                        break;
                    }
                    spec.value(value, flavour, &mut first, &mut out);
                }
            }
            None => {}
        }
        if out.len() > most {
            break;
        }
    }
    out.push_str(rest);
    truncate(&mut out, most);
    out
}

/// Letters that end a conversion.
const CONVERSIONS: &str = "cdefgimnopsuvxX";
/// Largest width and precision: larger ones count as this. A property of the language rather than a budget.
const MAX_WIDTH: usize = 4096;

fn truncate(out: &mut String, most: usize) {
    if out.len() > most {
        let mut end = most;
        while !out.is_char_boundary(end) {
            end -= 1;
        }
        out.truncate(end);
    }
}

/// A conversion: flags, width, precision, letter.
#[derive(Clone, Copy, Debug, Default)]
struct Spec {
    left: bool,
    plus: bool,
    blank: bool,
    zero: bool,
    alternate: bool,
    width: usize,
    precision: Option<usize>,
    letter: u8,
}

impl Spec {
    fn parse(text: &str, flavour: Flavour) -> Spec {
        let mut spec = Spec { letter: text.bytes().last().unwrap_or(b'g'), ..Spec::default() };
        let mut bytes = text.bytes().peekable();
        while let Some(b) = bytes.peek() {
            match b {
                b'-' => spec.left = true,
                b'+' => spec.plus = true,
                b' ' => spec.blank = true,
                b'0' => spec.zero = true,
                b'#' => spec.alternate = true,
                _ => break,
            }
            bytes.next();
        }
        let number = |bytes: &mut std::iter::Peekable<std::str::Bytes<'_>>| {
            let mut n = 0;
            while let Some(d) = bytes.next_if(u8::is_ascii_digit) {
                n = (n * 10 + usize::from(d - b'0')).min(MAX_WIDTH);
            }
            n
        };
        spec.width = number(&mut bytes);
        if bytes.next_if_eq(&b'.').is_some() {
            let none = flavour == Flavour::Print && !bytes.peek().is_some_and(u8::is_ascii_digit);
            spec.precision = Some(number(&mut bytes)).filter(|_| !none);
        }
        spec
    }

    /// Prints a value, each number except the first preceded by a blank.
    fn value(&self, value: &Const, flavour: Flavour, first: &mut bool, out: &mut String) {
        let mut separate = |out: &mut String| {
            if !std::mem::take(first) {
                out.push(' ');
            }
        };
        let floats: &[f32] = match value {
            Const::Float(x) => &[*x],
            Const::Triple(t) => t,
            Const::Matrix(m) => &m[..],
            Const::Int(n) => {
                separate(out);
                return self.int(*n, flavour, out);
            }
            Const::Str(s) => {
                separate(out);
                return self.string(s, flavour, out);
            }
            Const::Null => return,
        };
        for x in floats {
            separate(out);
            self.float(*x, flavour, out);
        }
    }

    fn string(&self, text: &str, flavour: Flavour, out: &mut String) {
        let cut: String = match self.precision {
            Some(n) => String::from_utf8_lossy(&text.as_bytes()[..text.len().min(n)]).into_owned(),
            None => text.to_string(),
        };
        let print = flavour == Flavour::Print;
        let zero = print && self.zero;
        let left = self.left || (print && !zero);
        Spec { left, zero, ..*self }.pad("", &cut, flavour, out);
    }

    fn int(&self, n: i32, flavour: Flavour, out: &mut String) {
        let negative = n < 0;
        let print = flavour == Flavour::Print;
        let prefixed = self.alternate && (print || n != 0);
        let (sign, digits) = match self.letter {
            b'x' => (if prefixed { "0x" } else { "" }, format!("{:x}", n as u32)),
            b'X' => (if prefixed { "0X" } else { "" }, format!("{:X}", n as u32)),
            b'o' if flavour == Flavour::Format => ("", format!("{:o}", n as u32)),
            b'o' => (if negative { "-" } else { "" }, format!("{:o}", n.unsigned_abs())),
            _ => (self.sign(negative), n.unsigned_abs().to_string()),
        };
        // Zeros fill the width and leave no room for a precision; otherwise a precision switches them off.
        let fills = self.zero && !self.left;
        let precision = self.precision.filter(|_| !(print && fills));
        let zeros = precision.unwrap_or(0).saturating_sub(digits.len());
        let octal = self.letter == b'o' && self.alternate && n != 0;
        let zeros = if octal && self.precision.unwrap_or(0) <= digits.len() { 1 } else { zeros };
        let digits = format!("{}{digits}", "0".repeat(zeros));
        Spec { zero: self.zero && (print || self.precision.is_none()), ..*self }
            .pad(sign, &digits, flavour, out);
    }

    fn sign(&self, negative: bool) -> &'static str {
        match (negative, self.plus, self.blank) {
            (true, ..) => "-",
            (_, true, _) => "+",
            (_, _, true) => " ",
            _ => "",
        }
    }

    fn float(&self, x: f32, flavour: Flavour, out: &mut String) {
        let sign = self.sign(x.is_sign_negative());
        if !x.is_finite() {
            let name = match (x.is_nan(), flavour) {
                (true, Flavour::Print) => "nan",
                (true, _) => "NaN",
                (false, Flavour::Print) => "inf",
                (false, _) => "Inf",
            };
            // The reference's `printf` aligns these to the left.
            let left = self.left || flavour == Flavour::Print;
            return Spec { zero: false, left, ..*self }.pad(sign, name, flavour, out);
        }
        let size = f64::from(x.abs());
        let precision = self.precision.unwrap_or(6);
        let digits = match self.letter {
            b'e' => exponential(size, precision, self.alternate),
            b'g' => general(size, precision, self.alternate),
            _ => format!("{size:.precision$}{}", if self.alternate && precision == 0 { "." } else { "" }),
        };
        self.pad(sign, &digits, flavour, out);
    }

    fn pad(&self, sign: &str, digits: &str, flavour: Flavour, out: &mut String) {
        let fill = self.width.saturating_sub(sign.len() + digits.chars().count());
        if self.left {
            let with = if self.zero && flavour == Flavour::Print { '0' } else { ' ' };
            out.push_str(sign);
            out.push_str(digits);
            out.extend(std::iter::repeat_n(with, fill));
        } else if self.zero {
            out.push_str(sign);
            out.extend(std::iter::repeat_n('0', fill));
            out.push_str(digits);
        } else {
            out.extend(std::iter::repeat_n(' ', fill));
            out.push_str(sign);
            out.push_str(digits);
        }
    }
}

/// `1.5e+03`: the exponent has a sign and at least two digits.
fn exponential(x: f64, precision: usize, alternate: bool) -> String {
    let text = format!("{x:.precision$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let point = if alternate && precision == 0 { "." } else { "" };
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{mantissa}{point}e{sign}{:02}", exponent.abs())
}

/// The shorter of the two forms by the rule of C, trailing zeros removed.
fn general(x: f64, precision: usize, alternate: bool) -> String {
    let digits = precision.max(1);
    let rounded = format!("{x:.*e}", digits - 1);
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let text = if exponent < -4 || exponent >= digits as i32 {
        exponential(x, digits - 1, alternate)
    } else {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{x:.decimals$}")
    };
    if alternate || !text.contains('.') {
        return text;
    }
    let (mantissa, exponent) = match text.find('e') {
        Some(at) => text.split_at(at),
        None => (&text[..], ""),
    };
    format!("{}{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(text: &str, values: &[Const]) -> String {
        let values: Vec<Value> = values.iter().map(|v| Value::Consts(vec![v.clone()])).collect();
        format(text, &values, Flavour::Print, 1 << 20)
    }

    #[test]
    fn ints() {
        let n = |n| vec![Const::Int(n)];
        assert_eq!(print("[%5d|", &n(42)), "[   42|");
        assert_eq!(print("%-5d|", &n(42)), "42   |");
        assert_eq!(print("%05d", &n(-42)), "-0042");
        assert_eq!(print("%5.3d", &n(10)), "  010");
        assert_eq!(print("%x", &n(-1)), "ffffffff");
        assert_eq!(print("%o", &n(-42)), "-52");
        assert_eq!(print("% d%%", &n(7)), " 7%");
        assert_eq!(print("%d", &n(i32::MIN)), "-2147483648");
    }

    #[test]
    fn flags() {
        let both = |text: &str, value: Const| {
            let values = [Value::Consts(vec![value])];
            [Flavour::Print, Flavour::Format].map(|flavour| format(text, &values, flavour, 1 << 20))
        };
        for (text, n, want) in [
            ("%#o", 9, ["011", "011"]),
            ("%#o", 0, ["0", "0"]),
            ("%#o", -1, ["-01", "037777777777"]),
            ("%#.5o", 9, ["00011", "00011"]),
            ("%#6o|", 8, ["   010|", "   010|"]),
            ("%-#6o|", 8, ["010   |", "010   |"]),
            ("%#08o", 9, ["00000011", "00000011"]),
            ("%#x", 0, ["0x0", "0"]),
            ("%#08x", 10, ["0x00000a", "0x00000a"]),
            ("%0.8i", 23, ["23", "00000023"]),
            ("%08.1d", -9, ["-0000009", "      -9"]),
            ("%-08d", 9, ["90000000", "9       "]),
            ("%-08.3d", 9, ["00900000", "009     "]),
        ] {
            assert_eq!(both(text, Const::Int(n)), want, "{text} of {n}");
        }
        assert_eq!(both("%.f", Const::Float(2.5)), ["2.500000", "2"]);
        assert_eq!(both("%5.1f|", Const::Float(f32::INFINITY)), ["inf  |", "  Inf|"]);
        assert_eq!(both("%-010.2f", Const::Float(2.5)), ["2.50000000", "2.50      "]);
        assert_eq!(both("%06s", Const::Str("abc".into())), ["000abc", "   abc"]);
        assert_eq!(both("%-06s", Const::Str("abc".into())), ["abc000", "abc   "]);
    }

    #[test]
    fn floats() {
        let x = |x| vec![Const::Float(x)];
        assert_eq!(print("%g", &x(1.0)), "1");
        assert_eq!(print("%g", &x(1e10)), "1e+10");
        assert_eq!(print("%g", &x(1e-5)), "1e-05");
        assert_eq!(print("%g", &x(100_000.0)), "100000");
        assert_eq!(print("%g", &x(1_234_567.0)), "1.23457e+06");
        assert_eq!(print("%g", &x(0.0)), "0");
        assert_eq!(print("%.3e", &x(0.5)), "5.000e-01");
        assert_eq!(print("%010.3f", &x(1.5)), "000001.500");
        assert_eq!(print("%5.1f", &x(f32::NAN)), "nan  ");
        assert_eq!(print("%.9g", &x(0.1)), "0.100000001");
        assert_eq!(print("%+.1f;", &[Const::Triple([1.0, -2.0, 0.5])]), "+1.0 -2.0 +0.5;");
    }

    #[test]
    fn strings_and_leftovers() {
        let s = vec![Const::Str("abc".into())];
        assert_eq!(print("%5s|", &s), "abc  |");
        let of = |flavour| format("%5.1s|%%", &[Value::Consts(s.clone())], flavour, 1 << 20);
        assert_eq!([of(Flavour::Format), of(Flavour::Folded)], ["    a|%", "    a|%%"]);
        assert_eq!(print("%s %d %", &s), "abc  %");
        assert_eq!(print("%99999999999s", &s).len(), MAX_WIDTH);
    }
}
