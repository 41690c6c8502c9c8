//! Numbers at the start of strings, as the C library's `strtol` and `strtof` read them.

/// Skips white space, takes a sign and digits; 0 without digits, saturated beyond the range.
pub(super) fn int(s: &str) -> i32 {
    let s = s.trim_start_matches(is_space);
    let (negative, digits) = sign(s);
    let mut value: i64 = 0;
    for digit in digits.bytes().take_while(u8::is_ascii_digit) {
        value = (value * 10 + i64::from(digit - b'0')).min(1 << 40);
    }
    let value = if negative { -value } else { value };
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// The longest prefix that is a number: decimal, hexadecimal, `inf` or `nan`; 0 without one.
pub(super) fn float(s: &str) -> f32 {
    let s = s.trim_start_matches(is_space);
    let (negative, rest) = sign(s);
    let lower: String = rest.chars().take(8).collect::<String>().to_ascii_lowercase();
    let value = if lower.starts_with("inf") {
        f32::INFINITY
    } else if lower.starts_with("nan") {
        f32::NAN
    } else if lower.starts_with("0x") {
        hexadecimal(&rest[2..])
    } else {
        rest[..decimal(rest)].parse().unwrap_or(0.0)
    };
    if negative { -value } else { value }
}

fn is_space(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\n' | '\r' | '\u{b}' | '\u{c}')
}

fn sign(s: &str) -> (bool, &str) {
    match s.as_bytes().first() {
        Some(b'-') => (true, &s[1..]),
        Some(b'+') => (false, &s[1..]),
        _ => (false, s),
    }
}

/// Length in bytes of the decimal number at the start.
fn decimal(s: &str) -> usize {
    let bytes = s.as_bytes();
    let digits = |from: usize| bytes.iter().skip(from).take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(0);
    let mut end = whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction > 0 {
            end += 1 + fraction;
        }
    }
    if end > 0 && matches!(bytes.get(end), Some(b'e' | b'E')) {
        let signed = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + signed);
        if exponent > 0 {
            end += 1 + signed + exponent;
        }
    }
    end
}

fn hexadecimal(s: &str) -> f32 {
    let mut value = 0.0_f64;
    let mut exponent = 0_i32;
    let mut fraction = false;
    let mut chars = s.char_indices();
    for (at, c) in chars.by_ref() {
        match (c, c.to_digit(16)) {
            (_, Some(digit)) => {
                value = value * 16.0 + f64::from(digit);
                exponent -= if fraction { 4 } else { 0 };
            }
            ('.', _) if !fraction => fraction = true,
            ('p' | 'P', _) => {
                exponent += int(&s[at + 1..]).clamp(-10_000, 10_000);
                break;
            }
            _ => break,
        }
    }
    // Two exact factors: a power beyond double precision may still give a representable number.
    let half = exponent / 2;
    (value * power_of_two(half) * power_of_two(exponent - half)) as f32
}

/// Two to a power, which is clamped to the range of double precision. The system's library need not be exact.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent.clamp(-1022, 1023) + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes() {
        assert_eq!(
            ["12abc", " -7", "1e3", "", "x", "99999999999", "+5", "0x10"].map(int),
            [12, -7, 1, 0, 0, i32::MAX, 5, 0]
        );
        assert_eq!(
            ["1.5x", ".5", "1e3", "1e", "-2.", "0x1f", "inf", "", ".", "1e-2e"].map(float),
            [1.5, 0.5, 1000.0, 1.0, -2.0, 31.0, f32::INFINITY, 0.0, 0.0, 0.01]
        );
        assert!(float("-nan").is_nan());
        assert_eq!(float("0x1p-1"), 0.5);
        // The smallest number, and powers beyond single and double precision.
        assert_eq!(float("0x1p-149").to_bits(), 1);
        assert_eq!(["0x1p-151", "0x1p-9999", "0x1p9999"].map(float), [0.0, 0.0, f32::INFINITY]);
        assert_eq!(float("0x100000000000000000000000000000000000000000p-160"), 16.0);
        assert_eq!(float("0x.0000000000000000000000000000000000000001p160"), 1.0);
    }
}
