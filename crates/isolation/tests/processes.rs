//! Tests guests as what they are, other processes: this program starts itself.
fn main() {}
