//! Surfaces compared with geometric facts.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

mod common;
mod displaced;
mod rays;
mod shapes;
mod subdivided;
