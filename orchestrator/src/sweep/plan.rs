//! The plan folder of a sweep: the values of its variants, and the scenario with all its files.

use std::path::{Path, PathBuf};

use ::sweep::table::{self, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable, SweepTableReader};
use diagnostics::Error;
use scenario::Scenario;
use scenario::document::VariantSelection;
use scenario::resolve::{Override, OverrideValue, Overrides};

use super::digest::{plan_digest, program_sha256};
use super::file_names::{GATHERED, PARTS, PLAN, SEARCHED, VARIANTS};
use super::plan_metadata::{PlanMetadata, VERSION};

/// The folder of a sweep.
pub struct SweepPlanFolder {
    /// Where it is.
    pub folder: PathBuf,
    /// What it says about itself.
    pub metadata: PlanMetadata,
    variants: SweepTableReader,
    /// The batches of a search so far.
    batches: Vec<SweepTable>,
}

impl SweepPlanFolder {
    /// Opens the plan in a folder, which this build of the program made.
    ///
    /// # Errors
    /// When there is none, another program made it, or its files changed.
    pub fn open(folder: &Path, program: &Path) -> Result<Self, Error> {
        let plan = Self::open_of_any_program(folder)?;
        if plan.metadata.program != program_sha256(program)? {
            return Err(Error::invalid_input(format!(
                "the plan in {} was made by another build of this program, which may give other results",
                folder.display()
            ))
            .with_help("make it again with this one: trackside sweep plan SCENARIO"));
        }
        plan.check_unchanged()?;
        Ok(plan)
    }

    /// Compares the files of the plan with its digest.
    ///
    /// # Errors
    /// When they are others than when it was made, or cannot be read.
    pub(super) fn check_unchanged(&self) -> Result<(), Error> {
        let folder = &self.folder;
        let found = plan_digest(&folder.join(GATHERED), &folder.join(VARIANTS), &self.metadata)?;
        if found == self.metadata.digest {
            return Ok(());
        }
        let message = format!("the files of the plan in {} were changed after it was made", folder.display());
        Err(Error::invalid_input(message).with_help("make it again: trackside sweep plan SCENARIO"))
    }

    /// Opens the plan in a folder, whoever made it.
    ///
    /// # Errors
    /// When there is none, or a value of it is none that a plan has.
    pub fn open_of_any_program(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(PLAN);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            Error::invalid_input(format!("there is no plan of a sweep in {}: {error}", folder.display()))
                .with_help("make one: trackside sweep plan SCENARIO --out FOLDER")
        })?;
        let metadata: PlanMetadata = serde_json::from_str(&text)
            .map_err(|error| Error::invalid_input(format!("{}: {error}", path.display())))?;
        if metadata.version != VERSION {
            let found = metadata.version;
            let message = format!("{}: expected version {VERSION}, found {found}", path.display());
            return Err(Error::invalid_input(message));
        }
        metadata.check_values().map_err(|what| {
            Error::invalid_input(format!("{}: {what}", path.display()))
                .with_help("make it again: trackside sweep plan SCENARIO")
        })?;
        let variants = SweepTableReader::open(&folder.join(VARIANTS))?;
        if variants.row_count() as u64 != metadata.variants {
            let (rows, wanted) = (variants.row_count(), metadata.variants);
            return Err(Error::invalid_input(format!(
                "{}: expected {wanted} rows, found {rows}",
                folder.join(VARIANTS).display()
            )));
        }
        let mut plan = SweepPlanFolder { folder: folder.to_owned(), metadata, variants, batches: Vec::new() };
        while plan.metadata.is_search && plan.batch_path(plan.batches.len()).exists() {
            plan.batches.push(table::read_table(&plan.batch_path(plan.batches.len()))?);
        }
        Ok(plan)
    }

    fn batch_path(&self, number: usize) -> PathBuf {
        self.folder.join(SEARCHED).join(format!("{number:06}.parquet"))
    }

    /// Adds a batch of a search, which is a chunk.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn add_batch(&mut self, batch: SweepTable) -> Result<(), Error> {
        let path = self.batch_path(self.batches.len());
        let folder = self.folder.join(SEARCHED);
        std::fs::create_dir_all(&folder).map_err(|error| Error::output_failure(&folder, error))?;
        table::write_table(&path, &batch)?;
        self.batches.push(batch);
        Ok(())
    }

    /// How many variants there are; of a search, so far.
    #[must_use]
    pub fn variant_count(&self) -> u64 {
        let searched: usize = self.batches.iter().map(SweepTable::row_count).sum();
        self.metadata.variants + searched as u64
    }

    /// How many chunks it has.
    #[must_use]
    pub fn chunk_count(&self) -> u64 {
        match self.metadata.is_search {
            true => self.batches.len() as u64,
            false => self.metadata.variants.div_ceil(self.metadata.chunk),
        }
    }

    /// The variants of a chunk, from its first one to before the last.
    #[must_use]
    pub fn variants_of_chunk(&self, chunk: u64) -> std::ops::Range<u64> {
        if self.metadata.is_search {
            let before = self.batches.iter().take(chunk as usize).map(SweepTable::row_count).sum::<usize>();
            let own = self.batches.get(chunk as usize).map_or(0, SweepTable::row_count);
            return before as u64..(before + own) as u64;
        }
        let first = chunk * self.metadata.chunk;
        first..(first + self.metadata.chunk).min(self.metadata.variants)
    }

    /// The chunk of a variant.
    #[must_use]
    pub fn chunk_of(&self, variant: u64) -> u64 {
        let holds = |chunk: &u64| self.variants_of_chunk(*chunk).contains(&variant);
        match self.metadata.is_search {
            true => (0..self.chunk_count()).find(holds).unwrap_or_default(),
            false => variant / self.metadata.chunk,
        }
    }

    /// The values of a chunk.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn chunk_values(&self, chunk: u64) -> Result<SweepTable, Error> {
        match self.batches.get(chunk as usize) {
            Some(batch) => Ok(batch.clone()),
            None => self.variants.read_row_group(chunk as usize),
        }
    }

    /// The columns of the values.
    #[must_use]
    pub fn value_columns(&self) -> &SweepTable {
        self.variants.columns()
    }

    /// The overrides of a row of values.
    #[must_use]
    pub fn row_overrides(values: &SweepTable, row: usize) -> Vec<Override> {
        let own = [SweepColumnRole::Variant, SweepColumnRole::Name];
        let varied = values.columns.iter().filter(|it| !own.contains(&it.role));
        varied.filter_map(|column| cell_override(column, row)).collect()
    }

    /// The overrides of a variant.
    ///
    /// # Errors
    /// When there is no such variant, or its values cannot be read.
    pub fn variant_overrides(&self, variant: u64) -> Result<Vec<Override>, Error> {
        let (variants, folder) = (self.variant_count(), self.folder.display());
        if variant >= variants {
            let message = format!(
                "the sweep in {folder} has the variants 0 to {}, found {variant}",
                variants.saturating_sub(1)
            );
            return Err(Error::invalid_input(message));
        }
        let chunk = self.chunk_of(variant);
        let row = (variant - self.variants_of_chunk(chunk).start) as usize;
        Ok(Self::row_overrides(&self.chunk_values(chunk)?, row))
    }

    /// What a variant is called, of a list with names.
    ///
    /// # Errors
    /// When its values cannot be read.
    pub fn variant_name(&self, variant: u64) -> Result<Option<String>, Error> {
        let chunk = self.chunk_of(variant);
        let place = variant.checked_sub(self.variants_of_chunk(chunk).start);
        let values = self.chunk_values(chunk)?;
        let names = values.columns_with_role(SweepColumnRole::Name).next().and_then(SweepColumn::as_texts);
        Ok(names.zip(place).and_then(|(names, place)| names.get(place as usize).cloned().flatten()))
    }

    /// The variant of a name.
    ///
    /// # Errors
    /// When the values cannot be read.
    pub fn variant_of_name(&self, name: &str) -> Result<Option<u64>, Error> {
        if self.value_columns().columns_with_role(SweepColumnRole::Name).next().is_none() {
            return Ok(None);
        }
        for chunk in 0..self.chunk_count() {
            let values = self.chunk_values(chunk)?;
            let names =
                values.columns_with_role(SweepColumnRole::Name).next().and_then(SweepColumn::as_texts);
            let place = names.unwrap_or_default().iter().position(|it| it.as_deref() == Some(name));
            if let Some(place) = place {
                return Ok(Some(self.variants_of_chunk(chunk).start + place as u64));
            }
        }
        Ok(None)
    }

    /// The folder of the files of a variant that is recorded, below that of the sweep: its number, and its name.
    ///
    /// # Errors
    /// When its values cannot be read.
    pub fn variant_folder_name(&self, variant: u64) -> Result<String, Error> {
        const LONGEST: usize = 60;
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let name =
            self.variant_name(variant)?.map(|name| name.chars().map(plain).take(LONGEST).collect::<String>());
        Ok(name.map_or_else(|| variant.to_string(), |name| format!("{variant}_{name}")))
    }

    /// The gathered scenario.
    #[must_use]
    pub fn scenario_path(&self) -> PathBuf {
        self.folder.join(GATHERED).join(format!("{}.toml", self.metadata.scenario))
    }

    /// The gathered scenario.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read_scenario(&self) -> Result<Scenario, Error> {
        Scenario::read(&self.scenario_path())
    }

    /// What all variants have.
    ///
    /// # Errors
    /// When an override has no form that a scenario takes.
    pub fn common_overrides(&self) -> Result<Overrides, Error> {
        let PlanMetadata { seed, tolerance, set, .. } = &self.metadata;
        let all = Overrides { seed: *seed, tolerance: *tolerance, ..Overrides::default() };
        self.with_variant(&all, set)
    }

    /// These overrides with those of a variant.
    ///
    /// # Errors
    /// When an override has no form that a scenario takes.
    pub fn with_variant(&self, all: &Overrides, variant: &[Override]) -> Result<Overrides, Error> {
        all.with_variant(variant, &self.folder.join(GATHERED)).map_err(Error::invalid_input)
    }

    /// The file of the results of a chunk.
    #[must_use]
    pub fn chunk_result_path(&self, chunk: u64) -> PathBuf {
        self.folder.join(PARTS).join(format!("{chunk:06}.parquet"))
    }

    /// Which variants run again with everything recorded.
    #[must_use]
    pub fn variants_to_record(&self) -> VariantSelection {
        let [worst, best, failed, every] = self.metadata.recorded;
        VariantSelection { worst, best, failed, every }
    }
}

fn cell_override(column: &SweepColumn, row: usize) -> Option<Override> {
    let value = match &column.values {
        // What is missing stays as in the scenario.
        SweepColumnValues::Numbers(all) => {
            let value = *all.get(row).filter(|value| !value.is_nan())?;
            OverrideValue::Number { value, unit: column.unit.clone() }
        }
        SweepColumnValues::Integers(all) => OverrideValue::Integer(*all.get(row)?),
        SweepColumnValues::Booleans(all) => OverrideValue::Boolean((*all.get(row)?)?),
        SweepColumnValues::Texts(all) => OverrideValue::parse(all.get(row)?.as_ref()?),
    };
    Some(Override::new(&column.name, value))
}
