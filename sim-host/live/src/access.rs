//! Decides who may read and command: programs on this computer that have the token, and no page of another origin.
//!
//! - The server listens on the loopback address only.
//! - The `Host` must be this server's: a name of another site that resolves to this computer (DNS rebinding) is refused.
//! - The `Origin`, if there is one, must be this server's: a page of another site is refused.
//! - Everything but the page itself, which holds no data, needs the token, in a header that a page of another origin cannot
//!   send without a permission that this server never gives (CORS).

use std::fmt::Write;
use std::net::SocketAddr;

use anyhow::Context;

use crate::http::Request;

/// Bytes of the token: 128 bits, which nobody guesses.
const TOKEN: usize = 16;

/// What a request must have.
#[derive(Debug, Clone)]
pub struct Access {
    hosts: [String; 2],
    token: String,
}

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// It is for another host.
    Host,
    /// It comes from a page of another origin.
    Origin,
    /// It has not the token.
    Token,
}

impl Access {
    /// For a server at this address, with a new token.
    ///
    /// # Errors
    /// If the operating system has no random numbers.
    pub fn new(address: SocketAddr) -> anyhow::Result<Self> {
        let mut bytes = [0; TOKEN];
        getrandom::fill(&mut bytes).context("the operating system has no random numbers")?;
        let token = bytes.iter().fold(String::new(), |mut text, byte| {
            // Writing to a string does not fail.
            let _ = write!(text, "{byte:02x}");
            text
        });
        let port = address.port();
        Ok(Self { hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")], token })
    }

    /// The token.
    #[must_use]
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Checks where a request comes from and which host it is for.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn page(&self, request: &Request) -> Result<(), Refusal> {
        let host = request.header("host").filter(|&host| self.hosts.iter().any(|own| own == host));
        let host = host.ok_or(Refusal::Host)?;
        let origin = request.header("origin");
        if origin.is_some_and(|origin| origin.strip_prefix("http://") != Some(host)) {
            return Err(Refusal::Origin);
        }
        Ok(())
    }

    /// As [`Self::page`], and the token.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn data(&self, request: &Request) -> Result<(), Refusal> {
        self.page(request)?;
        let given = request.header("authorization").and_then(|value| value.strip_prefix("Bearer "));
        let is_token = given.is_some_and(|given| is_equal(given.as_bytes(), self.token.as_bytes()));
        if is_token { Ok(()) } else { Err(Refusal::Token) }
    }
}

/// Compares in a time that does not depend on where the first difference is.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |found, (a, b)| found | (a ^ b)) == 0
}
