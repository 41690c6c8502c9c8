//! The integer expressions of `#if` and `#elif`.

use super::Preprocessor;
use crate::errors;
use crate::lexer::{PpToken, Raw};
use crate::span::Span;

impl Preprocessor<'_> {
    /// Whether the condition holds; false, with a message, if it has no value.
    pub(super) fn condition(&mut self, at: Span, tokens: &[PpToken]) -> bool {
        match self.replace_defined(tokens) {
            Err(fault) => self.report(at, fault),
            Ok(tokens) => {
                let tokens = self.expand_alone(&tokens);
                let mut eval = Eval { pp: self, tokens: &tokens, at: 0, depth: 0 };
                let value = eval.ternary(true);
                match value {
                    Ok(_) if eval.at < tokens.len() => {
                        let fault = eval.fault("an operator is missing");
                        self.report(at, fault)
                    }
                    Ok(v) => v != 0,
                    Err(fault) => self.report(at, fault),
                }
            }
        }
    }

    fn report(&mut self, at: Span, fault: Fault) -> bool {
        if !self.stopped {
            self.diagnostics.push(errors::condition(fault.span.unwrap_or(at), fault.why));
        }
        false
    }

    /// Replaces `defined NAME` and `defined(NAME)` by 1 or 0, before macros can change the name.
    fn replace_defined(&mut self, tokens: &[PpToken]) -> Result<Vec<PpToken>, Fault> {
        let mut out = Vec::with_capacity(tokens.len());
        let mut rest = tokens;
        while let Some((token, tail)) = rest.split_first() {
            rest = tail;
            if token.sym != self.special.defined || token.kind != Raw::Ident {
                out.push(*token);
                continue;
            }
            let name = match tail {
                [n, tail @ ..] if n.kind == Raw::Ident => {
                    rest = tail;
                    n
                }
                [open, n, close, tail @ ..]
                    if (open.kind, n.kind, close.kind) == (Raw::LParen, Raw::Ident, Raw::RParen) =>
                {
                    rest = tail;
                    n
                }
                _ => return Err(Fault { span: Some(token.span), why: "`defined` needs a name" }),
            };
            let sym = self.names.intern(if self.is_defined(name.sym) { "1" } else { "0" });
            out.push(PpToken { kind: Raw::Number, sym, ..*token });
        }
        Ok(out)
    }
}

/// Why and where a condition has no value.
struct Fault {
    span: Option<Span>,
    why: &'static str,
}

struct Eval<'e, 'a> {
    pp: &'e Preprocessor<'a>,
    tokens: &'e [PpToken],
    at: usize,
    depth: u64,
}

type Value = Result<i64, Fault>;

impl Eval<'_, '_> {
    fn peek(&self) -> Option<Raw> {
        self.tokens.get(self.at).map(|t| t.kind)
    }

    fn take(&mut self, kind: Raw) -> bool {
        let found = self.peek() == Some(kind);
        self.at += usize::from(found);
        found
    }

    fn fault(&self, why: &'static str) -> Fault {
        Fault { span: self.tokens.get(self.at).or(self.tokens.last()).map(|t| t.span), why }
    }

    /// `live` tells whether the value counts: a division by zero in an unused branch is not a fault.
    fn ternary(&mut self, live: bool) -> Value {
        self.depth += 1;
        if self.depth > self.pp.options.limits.reading.condition_depth {
            return Err(self.fault("nested too deep"));
        }
        let mut value = self.binary(0, live)?;
        if self.take(Raw::Question) {
            let yes = self.ternary(live && value != 0)?;
            if !self.take(Raw::Colon) {
                return Err(self.fault("`:` is missing"));
            }
            let no = self.ternary(live && value == 0)?;
            value = if value != 0 { yes } else { no };
        }
        self.depth -= 1;
        Ok(value)
    }

    fn binary(&mut self, least: u8, live: bool) -> Value {
        let mut left = self.unary(live)?;
        while let Some(op) = self.peek() {
            let Some(level) = level(op, self.tokens.get(self.at).map(|t| self.pp.names.str(t.sym))) else {
                break;
            };
            if level < least {
                break;
            }
            let at = self.at;
            self.at += 1;
            let right_live = live
                && match level {
                    0 => left == 0,
                    1 => left != 0,
                    _ => true,
                };
            let right = self.binary(level + 1, right_live)?;
            left = match apply(op, level, left, right) {
                Some(v) => v,
                None if live => {
                    self.at = at;
                    return Err(self.fault("division by zero"));
                }
                None => 0,
            };
        }
        Ok(left)
    }

    fn unary(&mut self, live: bool) -> Value {
        let Some(token) = self.tokens.get(self.at) else {
            return Err(self.fault("a value is missing at its end"));
        };
        let text = self.pp.names.str(token.sym);
        self.at += 1;
        let prefix: fn(i64) -> i64 = match token.kind {
            Raw::Minus => i64::wrapping_neg,
            Raw::Plus => |v| v,
            Raw::Tilde => |v| !v,
            Raw::Bang => |v| i64::from(v == 0),
            Raw::Ident if text == "not" => |v| i64::from(v == 0),
            Raw::Ident => return Ok(i64::from(text == "true")),
            Raw::Number => return number(text).ok_or_else(|| self.fault_before("not an integer")),
            Raw::Char => return character(text).ok_or_else(|| self.fault_before("not one character")),
            Raw::LParen => {
                let value = self.ternary(live)?;
                if !self.take(Raw::RParen) {
                    return Err(self.fault("`)` is missing"));
                }
                return Ok(value);
            }
            _ => return Err(self.fault_before("not a value")),
        };
        self.depth += 1;
        if self.depth > self.pp.options.limits.reading.condition_depth {
            return Err(self.fault("nested too deep"));
        }
        let value = self.unary(live)?;
        self.depth -= 1;
        Ok(prefix(value))
    }

    fn fault_before(&self, why: &'static str) -> Fault {
        Fault { span: self.tokens.get(self.at.saturating_sub(1)).map(|t| t.span), why }
    }
}

/// The binding strength of a binary operator; 0 is the loosest.
fn level(op: Raw, text: Option<&str>) -> Option<u8> {
    Some(match op {
        Raw::PipePipe => 0,
        Raw::AmpAmp => 1,
        Raw::Ident if text == Some("or") => 0,
        Raw::Ident if text == Some("and") => 1,
        Raw::Pipe => 2,
        Raw::Caret => 3,
        Raw::Amp => 4,
        Raw::EqEq | Raw::NotEq => 5,
        Raw::Lt | Raw::Gt | Raw::Le | Raw::Ge => 6,
        Raw::Shl | Raw::Shr => 7,
        Raw::Plus | Raw::Minus => 8,
        Raw::Star | Raw::Slash | Raw::Percent => 9,
        _ => return None,
    })
}

/// The value of a binary operator; `None` for a division by zero.
fn apply(op: Raw, level: u8, a: i64, b: i64) -> Option<i64> {
    Some(match op {
        _ if level == 0 => i64::from(a != 0 || b != 0),
        _ if level == 1 => i64::from(a != 0 && b != 0),
        Raw::Pipe => a | b,
        Raw::Caret => a ^ b,
        Raw::Amp => a & b,
        Raw::EqEq => i64::from(a == b),
        Raw::NotEq => i64::from(a != b),
        Raw::Lt => i64::from(a < b),
        Raw::Gt => i64::from(a > b),
        Raw::Le => i64::from(a <= b),
        Raw::Ge => i64::from(a >= b),
        Raw::Shl => a.wrapping_shl(b as u32),
        Raw::Shr => a.wrapping_shr(b as u32),
        Raw::Plus => a.wrapping_add(b),
        Raw::Minus => a.wrapping_sub(b),
        Raw::Star => a.wrapping_mul(b),
        _ if b == 0 => return None,
        Raw::Slash => a.wrapping_div(b),
        _ => a.wrapping_rem(b),
    })
}

/// A C integer: decimal, octal or hexadecimal, with its suffixes.
fn number(text: &str) -> Option<i64> {
    let digits = text.trim_end_matches(['u', 'U', 'l', 'L']);
    let value = if let Some(hex) = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        u64::from_str_radix(hex, 16)
    } else if digits.len() > 1 && digits.starts_with('0') {
        u64::from_str_radix(digits, 8)
    } else {
        digits.parse()
    };
    value.ok().map(|v| v as i64)
}

/// The value of a character constant.
fn character(text: &str) -> Option<i64> {
    let inner = crate::token::unescape(&text.replace('\'', "\""));
    let mut chars = inner.chars();
    let first = chars.next();
    if chars.next().is_some() {
        return None;
    }
    Some(first.map_or(0, |c| i64::from(u32::from(c))))
}
