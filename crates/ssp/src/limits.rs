//! Defines limits on what a hostile system can cost.

/// All descriptions, parameters, mappings and dictionaries of a system may have this many bytes together.
pub(crate) const LONGEST: u64 = 128 << 20;

/// Systems may lie in each other this deep.
pub(crate) const DEEPEST: usize = 100;

/// A system may have this many elements after all references to other systems were followed.
pub(crate) const ELEMENTS: usize = 100_000;

/// A system may have this many connectors and connections after all references to other systems were followed.
pub(crate) const CONNECTORS: usize = 1_000_000;

/// Parameter bindings may be looked up this often in all.
pub(crate) const LOOKUPS: usize = 2_000_000;

/// A connection may pass through this many connectors of systems.
pub(crate) const STATIONS: usize = 300;

/// All start values of a system together may have this many elements.
pub(crate) const CELLS: usize = 1 << 20;

/// So many notes are kept.
pub(crate) const NOTES: usize = 1_000;

/// A name may have this many bytes, with those of all systems around it.
pub(crate) const NAME: usize = 1_000;
