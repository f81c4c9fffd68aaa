//! The plan folder of a sweep: the values of its variants, and the scenario with all its files.

use std::path::{Path, PathBuf};

use ::sweep::table::{self, Column, Reader, Role, Table, Values};
use diagnostics::Error;
use scenario::Scenario;
use scenario::document::VariantSelection;
use scenario::resolve::{Override, OverrideValue, Overrides};

use super::digest::{digest, digest_of_program};
use super::file_names::{GATHERED, PARTS, PLAN, SEARCHED, VARIANTS};
use super::plan_metadata::{PlanMetadata, VERSION};

/// The folder of a sweep.
pub struct Plan {
    /// Where it is.
    pub folder: PathBuf,
    /// What it says about itself.
    pub metadata: PlanMetadata,
    variants: Reader,
    /// The batches of a search so far.
    batches: Vec<Table>,
}

impl Plan {
    /// Opens the plan in a folder, which this build of the program made.
    ///
    /// # Errors
    /// When there is none, another program made it, or its files changed.
    pub fn open(folder: &Path, program: &Path) -> Result<Self, Error> {
        let plan = Self::look_at(folder)?;
        if plan.metadata.program != digest_of_program(program)? {
            return Err(Error::input(format!(
                "the plan in {} was made by another build of this program, which may give other results",
                folder.display()
            ))
            .help("make it again with this one: trackside sweep plan SCENARIO"));
        }
        let bundle = folder.join(GATHERED);
        let found = digest(&bundle, &folder.join(VARIANTS), &plan.metadata)?;
        if found != plan.metadata.digest {
            return Err(Error::input(format!(
                "the files of the plan in {} were changed after it was made",
                folder.display()
            ))
            .help("make it again: trackside sweep plan SCENARIO"));
        }
        Ok(plan)
    }

    /// Opens the plan in a folder, whoever made it.
    ///
    /// # Errors
    /// When there is none.
    pub fn look_at(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(PLAN);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            Error::input(format!("there is no plan of a sweep in {}: {error}", folder.display()))
                .help("make one: trackside sweep plan SCENARIO --out FOLDER")
        })?;
        let metadata: PlanMetadata = serde_json::from_str(&text)
            .map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
        if metadata.version != VERSION {
            let found = metadata.version;
            let message = format!("{}: expected version {VERSION}, found {found}", path.display());
            return Err(Error::input(message));
        }
        let variants = Reader::open(&folder.join(VARIANTS))?;
        if variants.rows() as u64 != metadata.variants {
            let (rows, wanted) = (variants.rows(), metadata.variants);
            return Err(Error::input(format!(
                "{}: expected {wanted} rows, found {rows}",
                folder.join(VARIANTS).display()
            )));
        }
        let mut plan = Plan { folder: folder.to_owned(), metadata, variants, batches: Vec::new() };
        while plan.metadata.is_search && plan.batch(plan.batches.len()).exists() {
            plan.batches.push(table::read(&plan.batch(plan.batches.len()))?);
        }
        Ok(plan)
    }

    fn batch(&self, number: usize) -> PathBuf {
        self.folder.join(SEARCHED).join(format!("{number:06}.parquet"))
    }

    /// Adds a batch of a search, which is a chunk.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn add(&mut self, batch: Table) -> Result<(), Error> {
        let path = self.batch(self.batches.len());
        let folder = self.folder.join(SEARCHED);
        std::fs::create_dir_all(&folder).map_err(|error| Error::output(&folder, error))?;
        table::write(&path, &batch)?;
        self.batches.push(batch);
        Ok(())
    }

    /// How many variants there are; of a search, so far.
    #[must_use]
    pub fn variants(&self) -> u64 {
        let searched: usize = self.batches.iter().map(Table::rows).sum();
        self.metadata.variants + searched as u64
    }

    /// How many chunks it has.
    #[must_use]
    pub fn chunks(&self) -> u64 {
        match self.metadata.is_search {
            true => self.batches.len() as u64,
            false => self.metadata.variants.div_ceil(self.metadata.chunk),
        }
    }

    /// The variants of a chunk, from its first one to before the last.
    #[must_use]
    pub fn range(&self, chunk: u64) -> std::ops::Range<u64> {
        if self.metadata.is_search {
            let before = self.batches.iter().take(chunk as usize).map(Table::rows).sum::<usize>();
            let own = self.batches.get(chunk as usize).map_or(0, Table::rows);
            return before as u64..(before + own) as u64;
        }
        let first = chunk * self.metadata.chunk;
        first..(first + self.metadata.chunk).min(self.metadata.variants)
    }

    /// The chunk of a variant.
    #[must_use]
    pub fn chunk_of(&self, variant: u64) -> u64 {
        let holds = |chunk: &u64| self.range(*chunk).contains(&variant);
        match self.metadata.is_search {
            true => (0..self.chunks()).find(holds).unwrap_or_default(),
            false => variant / self.metadata.chunk,
        }
    }

    /// The values of a chunk.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn values(&self, chunk: u64) -> Result<Table, Error> {
        match self.batches.get(chunk as usize) {
            Some(batch) => Ok(batch.clone()),
            None => self.variants.group(chunk as usize),
        }
    }

    /// The columns of the values.
    #[must_use]
    pub fn columns(&self) -> &Table {
        self.variants.columns()
    }

    /// The overrides of a row of values.
    #[must_use]
    pub fn overrides_of_row(values: &Table, row: usize) -> Vec<Override> {
        let varied = values.columns.iter().filter(|it| it.role != Role::Variant);
        varied.filter_map(|column| override_of_cell(column, row)).collect()
    }

    /// The overrides of a variant.
    ///
    /// # Errors
    /// When there is no such variant, or its values cannot be read.
    pub fn overrides_of(&self, variant: u64) -> Result<Vec<Override>, Error> {
        let (variants, folder) = (self.variants(), self.folder.display());
        if variant >= variants {
            let message = format!(
                "the sweep in {folder} has the variants 0 to {}, found {variant}",
                variants.saturating_sub(1)
            );
            return Err(Error::input(message));
        }
        let chunk = self.chunk_of(variant);
        let row = (variant - self.range(chunk).start) as usize;
        Ok(Self::overrides_of_row(&self.values(chunk)?, row))
    }

    /// The gathered scenario.
    #[must_use]
    pub fn scenario_file(&self) -> PathBuf {
        self.folder.join(GATHERED).join(format!("{}.toml", self.metadata.scenario))
    }

    /// The gathered scenario.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn scenario(&self) -> Result<Scenario, Error> {
        Scenario::read(&self.scenario_file())
    }

    /// What all variants have.
    ///
    /// # Errors
    /// When an override has no form that a scenario takes.
    pub fn overrides(&self) -> Result<Overrides, Error> {
        let PlanMetadata { seed, tolerance, set, .. } = &self.metadata;
        let all = Overrides { seed: *seed, tolerance: *tolerance, ..Overrides::default() };
        self.with_variant(&all, set)
    }

    /// These overrides with those of a variant.
    ///
    /// # Errors
    /// When an override has no form that a scenario takes.
    pub fn with_variant(&self, all: &Overrides, variant: &[Override]) -> Result<Overrides, Error> {
        all.with_variant(variant, &self.folder.join(GATHERED)).map_err(Error::input)
    }

    /// The file of the results of a chunk.
    #[must_use]
    pub fn part(&self, chunk: u64) -> PathBuf {
        self.folder.join(PARTS).join(format!("{chunk:06}.parquet"))
    }

    /// Which variants run again with everything recorded.
    #[must_use]
    pub fn recorded(&self) -> VariantSelection {
        let [worst, best, failed, every] = self.metadata.recorded;
        VariantSelection { worst, best, failed, every }
    }
}

fn override_of_cell(column: &Column, row: usize) -> Option<Override> {
    let value = match &column.values {
        Values::Numbers(all) => {
            OverrideValue::Number { value: *all.get(row)?, unit: column.unit.clone() }
        }
        Values::Integers(all) => OverrideValue::Integer(*all.get(row)?),
        Values::Booleans(all) => OverrideValue::Boolean((*all.get(row)?)?),
        Values::Texts(all) => OverrideValue::parse(all.get(row)?.as_ref()?),
    };
    Some(Override::new(&column.name, value))
}
