//! Calculates the checksum of the rows of a table, which its file has too: compression does not notice each bit that turns.

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use super::{SweepColumn, SweepTable};

/// The key of the metadata of a file that has the checksum.
pub(super) const KEY: &str = "rows_sha256";

/// SHA-256 of the columns and of all rows so far.
pub(super) struct RowChecksum(Sha256);

impl RowChecksum {
    pub fn new(columns: &SweepTable) -> Self {
        let mut checksum = Sha256::new();
        for SweepColumn { name, unit, role, .. } in &columns.columns {
            checksum.update(format!("{name:?} {unit:?} {role:?}\n"));
        }
        RowChecksum(checksum)
    }

    /// Row by row, so that rows give the same however they come.
    pub fn add_rows(&mut self, table: &SweepTable) {
        let mut bytes = Vec::new();
        for row in 0..table.row_count() {
            bytes.clear();
            table.columns.iter().for_each(|column| column.values.push_value_bytes(row, &mut bytes));
            self.0.update(&bytes);
        }
    }

    /// In hexadecimal digits.
    pub fn finish(self) -> String {
        self.0.finalize().iter().fold(String::new(), |mut digits, byte| {
            // Writing into a string cannot fail.
            let _ = write!(digits, "{byte:02x}");
            digits
        })
    }
}
