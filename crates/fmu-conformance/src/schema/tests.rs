//! Damages descriptions in many ways and asks for the mistake by its line.

use super::*;
