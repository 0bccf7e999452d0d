//! What the driver can do, as functions: each command and each test calls them.

pub mod gate;
pub mod tidy;
