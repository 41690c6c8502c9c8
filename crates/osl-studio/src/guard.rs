//! Who may talk to the server: the secret in the address, the name of the host, and the page that asks.
//!
//! A page from elsewhere in the same browser can send requests to the loopback interface. It does not know
//! the secret, its `Origin` is another one, and after a name of its own was made to point here, the `Host` is
//! another one too.

use std::fmt::Write;

/// Bytes of a secret that is made by chance.
const RANDOM_BYTES: usize = 16;
/// The smallest number of characters of a secret that the user chooses.
const SHORTEST: usize = 16;

/// The secret part of the address.
#[derive(Clone)]
pub struct Token(String);

impl std::fmt::Debug for Token {
    /// A secret is not for logs.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// A secret of 128 random bits.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub fn random() -> Result<Token, String> {
        let mut bytes = [0; RANDOM_BYTES];
        getrandom::fill(&mut bytes).map_err(|why| format!("the system gives no random numbers: {why}"))?;
        let mut text = String::new();
        for byte in bytes {
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Token(text))
    }

    /// A secret that the user chooses.
    ///
    /// # Errors
    /// It is too short, or has other characters than letters, digits, `-` and `_`.
    pub fn chosen(text: &str) -> Result<Token, String> {
        if text.len() < SHORTEST {
            return Err(format!("a token has at least {SHORTEST} characters"));
        }
        match text.bytes().all(|c| c.is_ascii_alphanumeric() || matches!(c, b'-' | b'_')) {
            true => Ok(Token(text.to_string())),
            false => Err("a token has only letters, digits, `-` and `_`".to_string()),
        }
    }

    /// The secret as text.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Whether a text is the secret. The time does not tell how much of it is right.
    fn is(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        own.len() == other.len() && own.iter().zip(other).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
    }

    /// The rest of a path that begins with the secret: `page.js` of `/SECRET/page.js`.
    pub(crate) fn rest<'a>(&self, path: &'a str) -> Option<&'a str> {
        let (first, rest) = path.strip_prefix('/')?.split_once('/')?;
        self.is(first).then_some(rest)
    }
}

/// The hosts under which the server is known at a port.
fn hosts(port: u16) -> [String; 2] {
    [format!("127.0.0.1:{port}"), format!("localhost:{port}")]
}

/// Whether the header `Host` names this server.
pub(crate) fn is_host(host: Option<&str>, port: u16) -> bool {
    host.is_some_and(|host| hosts(port).iter().any(|own| host.eq_ignore_ascii_case(own)))
}

/// Whether the header `Origin` names a page of this server.
pub(crate) fn is_origin(origin: &str, port: u16) -> bool {
    hosts(port).iter().any(|own| origin.eq_ignore_ascii_case(&format!("http://{own}")))
}

/// What a page of this server may load: only its own modules, styles and socket, and pictures that it makes.
pub(crate) fn policy(port: u16) -> String {
    let [address, name] = hosts(port);
    format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' \
         ws://{address} ws://{name}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_secret_opens() {
        let token = Token::chosen("0123456789abcdef").unwrap();
        assert_eq!(token.rest("/0123456789abcdef/a.js"), Some("a.js"));
        assert_eq!(token.rest("/0123456789abcdef/"), Some(""));
        for wrong in ["/", "/a.js", "/0123456789abcde/a.js", "/0123456789abcdeg/", "0123456789abcdef/", ""] {
            assert_eq!(token.rest(wrong), None, "{wrong}");
        }
        assert!(Token::chosen("short").is_err() && Token::chosen("0123456789abcde/").is_err());
        assert_ne!(Token::random().unwrap().text(), Token::random().unwrap().text());
    }

    #[test]
    fn hosts_and_origins_are_those_of_the_server() {
        assert!(is_host(Some("127.0.0.1:80"), 80) && is_host(Some("LocalHost:80"), 80));
        for wrong in [None, Some("127.0.0.1"), Some("127.0.0.1:81"), Some("evil.example:80")] {
            assert!(!is_host(wrong, 80), "{wrong:?}");
        }
        assert!(is_origin("http://localhost:80", 80));
        for wrong in ["null", "http://evil.example", "https://localhost:80", "http://localhost:81"] {
            assert!(!is_origin(wrong, 80), "{wrong}");
        }
    }
}
