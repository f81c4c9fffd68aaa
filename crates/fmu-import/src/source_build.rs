//! Compiles the sources of an FMU that has no library for this machine: once, by the compiler of the system, into the user's cache folder.
//!
//! The library is then copied to where the archive would have it, so all that comes after finds it there, also in the sandbox of a process of its
//! own. Bits do not depend on the machine: no code for one processor alone, no fused sums that the sources do not ask for.

mod build_configuration;
mod compiler;
mod exported_names;
mod headers;
mod library_cache;
mod source_folder;

use std::ffi::OsString;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use archive::TemporaryFolder;
use sha2::{Digest as _, Sha256};

use self::build_configuration::{BUILD_DESCRIPTION, BuildConfiguration, SourceFileSet};
use self::compiler::Compiler;
use self::library_cache::LibraryCache;
use self::source_folder::{SOURCES, SourceFolder, is_cpp};
use crate::{Fmu, OpenError};

/// Options for all sources, before those of the archive. Warnings are for those who write the sources.
const OPTIONS: [&str; 6] = ["-c", "-fPIC", "-O2", "-ffp-contract=off", "-w", "-fdiagnostics-color=never"];

/// The language of sources in C that name none: compilers of different years have different ones.
const STANDARD: &str = "-std=gnu11";

/// Options for the library: functions of the FMU are its own, also where this process has others of their names.
const LINK_OPTIONS: [&str; 2] = ["-shared", "-Wl,-Bsymbolic"];

/// Counts up when libraries are made in another way than before.
const SCHEME: u32 = 1;

/// The sources of an FMU, and how they are compiled.
#[derive(Debug)]
#[non_exhaustive]
pub struct CompilationPlan {
    configuration: BuildConfiguration,
    compiler: Compiler,
    /// For sources in C++.
    cpp_compiler: Option<Compiler>,
}

/// A library that was compiled from sources.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct CompiledLibrary {
    /// Where it is kept, or why it is not.
    kept: Result<PathBuf, String>,
    /// How long it took; nothing when it was there.
    duration: Option<Duration>,
    compiler: String,
    notes: Vec<String>,
}

impl fmt::Display for CompiledLibrary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let CompiledLibrary { kept, duration, compiler, notes } = self;
        match duration {
            Some(time) => {
                write!(out, "its sources were compiled by {compiler} in {:.1} s", time.as_secs_f64())?
            }
            None => write!(out, "its sources were compiled before by {compiler}")?,
        }
        match kept {
            Ok(path) => write!(out, "; the library is {}", path.display())?,
            Err(why) => write!(out, "; the library is not kept for the next run: {why}")?,
        }
        notes.iter().try_for_each(|note| write!(out, "; {note}"))
    }
}

impl fmt::Display for CompilationPlan {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.files().count();
        let word = if count == 1 { "file" } else { "files" };
        let compilers: Vec<_> = [Some(&self.compiler), self.cpp_compiler.as_ref()]
            .into_iter()
            .flatten()
            .map(Compiler::name)
            .collect();
        write!(out, "{count} {word} in {SOURCES}, by {}", compilers.join(" and "))
    }
}

impl CompilationPlan {
    fn files(&self) -> impl Iterator<Item = (&SourceFileSet, &String)> {
        self.configuration.sets.iter().flat_map(|set| set.files.iter().map(move |file| (set, file)))
    }

    fn compiler_of(&self, file: &str) -> &Compiler {
        self.cpp_compiler.as_ref().filter(|_| is_cpp(file)).unwrap_or(&self.compiler)
    }

    /// The arguments for a file but for what differs from run to run.
    fn arguments(set: &SourceFileSet, file: &str) -> Vec<String> {
        let standard = match (&set.language, is_cpp(file)) {
            (Some(language), _) => standard_option(language),
            (None, true) => None,
            (None, false) => Some(STANDARD.to_owned()),
        };
        let folders = set.include_folders.iter().map(|folder| format!("-I{folder}"));
        let fixed = OPTIONS.iter().map(|option| (*option).to_owned());
        let all = fixed.chain(standard).chain(set.options.iter().cloned()).chain(folders);
        all.chain([format!("{SOURCES}/{file}")]).collect()
    }

    fn link_arguments(&self) -> Vec<String> {
        let libraries = self.configuration.libraries.iter().map(String::as_str).chain(["m"]);
        libraries.map(|name| format!("-l{name}")).collect()
    }

    /// All that the library depends on, as a number.
    fn key(&self, folder: &SourceFolder, archive: &str) -> io::Result<String> {
        let mut hash = Sha256::new();
        let compilers = [Some(&self.compiler), self.cpp_compiler.as_ref()];
        let compilers: Vec<_> = compilers.into_iter().flatten().map(Compiler::identity).collect();
        let commands: Vec<_> = self.files().map(|(set, file)| Self::arguments(set, file)).collect();
        let machine = (std::env::consts::OS, std::env::consts::ARCH);
        let head =
            (SCHEME, machine, compilers, commands, LINK_OPTIONS, self.link_arguments(), headers::HEADERS);
        hash.update(format!("{head:?}"));
        if folder.includes().leaves_folder {
            hash.update(archive);
        }
        folder.hash_into(&mut hash)?;
        Ok(hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect())
    }

    /// Makes the library at `library` of an archive that is unpacked to `root`.
    fn build(&self, root: &Path, library: &Path) -> Result<(), BuildError> {
        let deadline = Instant::now() + compiler::LIMIT;
        let scratch = TemporaryFolder::new()?;
        headers::write_headers(scratch.folder_path())?;
        let object = |place: usize| scratch.folder_path().join(format!("{place}.o"));
        let jobs: Vec<_> = self.files().collect();
        let compile = |place: usize, (set, file): &(&SourceFileSet, &String)| {
            let mut arguments: Vec<OsString> =
                Self::arguments(set, file).into_iter().map(OsString::from).collect();
            // Those of the archive come first.
            arguments.extend(["-I".into(), scratch.folder_path().into(), "-o".into(), object(place).into()]);
            self.compiler_of(file).run(root, &arguments, deadline)
        };
        compiler::run_all(&jobs, compile)?;
        let linker = self.cpp_compiler.as_ref().unwrap_or(&self.compiler);
        let link = |more: Vec<String>| {
            let mut arguments: Vec<OsString> = LINK_OPTIONS.iter().map(OsString::from).collect();
            arguments.extend((0..jobs.len()).map(|place| object(place).into()));
            arguments.extend(["-o".into(), library.into()]);
            arguments.extend(self.link_arguments().into_iter().chain(more).map(OsString::from));
            linker.run(root, &arguments, deadline)
        };
        link(Vec::new())?;
        let aliases = exported_names::alias_options(library)?;
        if !aliases.is_empty() {
            link(aliases)?;
        }
        Ok(())
    }
}

/// The option for a language by the name that a build description gives it, such as `C99` or `C++11`: with what GNU adds, as `M_PI`.
fn standard_option(language: &str) -> Option<String> {
    let year = |text: &str| {
        (!text.is_empty() && text.chars().all(|it| it.is_ascii_digit())).then(|| text.to_owned())
    };
    match language.strip_prefix("C++") {
        Some(rest) => year(rest).map(|year| format!("-std=gnu++{year}")),
        None => year(language.strip_prefix('C')?).map(|year| format!("-std=gnu{year}")),
    }
}

/// Why there is no library.
#[derive(Debug, thiserror::Error)]
enum BuildError {
    /// The sources do not compile.
    #[error("{0}")]
    Sources(String),
    /// Files cannot be read or written.
    #[error(transparent)]
    Files(#[from] io::Error),
}

impl From<String> for BuildError {
    fn from(what: String) -> Self {
        BuildError::Sources(what)
    }
}

impl Fmu {
    /// How its sources would be compiled for this machine, which archives call `platform`; nothing of one without sources. Nothing is run for that.
    ///
    /// # Errors
    /// In a sentence, when they cannot be compiled.
    pub(crate) fn compilation_plan(&self, platform: &str) -> Option<Result<CompilationPlan, String>> {
        let folder = SourceFolder::read(self.folder.description_folder());
        folder.sources().next()?;
        Some(self.plan_compilation_of(platform, &folder))
    }

    fn plan_compilation_of(&self, platform: &str, folder: &SourceFolder) -> Result<CompilationPlan, String> {
        let xml = self.description_text().map_err(|error| error.to_string())?;
        let build_description = self.read_archive_entry(BUILD_DESCRIPTION);
        let text = build_description.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let configuration =
            BuildConfiguration::choose(&self.description, platform, &xml, text.as_deref(), folder)?;
        let files = || configuration.sets.iter().flat_map(|set| &set.files);
        if files().next().is_none() {
            return Err("none of them is to be compiled".to_owned());
        }
        let compiler = Compiler::find(&compiler::C)?;
        let has_cpp = files().any(|file| is_cpp(file));
        let cpp_compiler = has_cpp.then(|| Compiler::find(&compiler::CPP)).transpose()?;
        Ok(CompilationPlan { configuration, compiler, cpp_compiler })
    }

    /// Compiles the library, or takes the one that was compiled before, and puts it to `library` in the unpacked archive.
    pub(crate) fn compile_sources(
        &self,
        build: &CompilationPlan,
        library: &Path,
    ) -> Result<CompiledLibrary, OpenError> {
        let notes = &build.configuration.notes;
        let failed = |error: BuildError| {
            let what =
                [error.to_string()].into_iter().chain(notes.iter().cloned()).collect::<Vec<_>>().join("; ");
            OpenError::Sources { path: self.path.clone(), what }
        };
        let root = self.folder.description_folder();
        let begin = Instant::now();
        let make = |path: &Path| build.build(root, path);
        let made = LibraryCache::open().map(|cache| {
            let key = build.key(&SourceFolder::read(root), &self.sha256)?;
            let key = format!("{}-{key}", self.description.identifier);
            let (kept, is_new) = cache.find_or_build(&key, make)?;
            library_cache::copy_library(&kept, library)?;
            Ok((kept, is_new))
        });
        let (kept, is_new) = match made {
            Ok(made) => made.map(|(path, is_new)| (Ok(path), is_new)).map_err(failed)?,
            Err(why) => {
                library_cache::make_library(library, make).map_err(failed)?;
                (Err(why), true)
            }
        };
        Ok(CompiledLibrary {
            kept,
            duration: is_new.then(|| begin.elapsed()),
            compiler: build.compiler.name(),
            notes: notes.clone(),
        })
    }
}
