//! Reads the part of an ELF file that the loader of Linux goes by: names, needs, search paths, and symbols for a whole process.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::path::Path;

use object::elf::{
    DT_NEEDED, DT_RPATH, DT_RUNPATH, DT_SONAME, SHF_WRITE, SHT_DYNAMIC, SHT_DYNSYM, SHT_NOBITS,
    STB_GNU_UNIQUE, STB_WEAK,
};
use object::pod::slice_from_all_bytes;
use object::read::StringTable;
use object::read::elf::{Dyn as _, FileHeader, SectionHeader as _, Sym as _};
use object::{Endianness, elf};

#[cfg(target_pointer_width = "64")]
type Header = elf::FileHeader64<Endianness>;
#[cfg(not(target_pointer_width = "64"))]
type Header = elf::FileHeader32<Endianness>;
type Section = <Header as FileHeader>::SectionHeader;
type Symbol = <Header as FileHeader>::Sym;

/// A longer table is none that a library has [bytes].
const LONGEST: u64 = 1 << 28;

/// Functions of Python that each library calls which has Python in its process.
const PYTHON: [&[u8]; 2] = [b"Py_Initialize", b"PyGILState_Ensure"];

/// What the loader reads of a library.
#[derive(Debug, Default)]
pub(super) struct ElfLinkInfo {
    /// The name by which others need it (`DT_SONAME`).
    pub soname: Option<String>,
    /// The libraries that it needs (`DT_NEEDED`).
    pub needed: Vec<String>,
    /// Where they are looked for before all else (`DT_RPATH`).
    pub rpath: Option<String>,
    /// Where they are looked for after `LD_LIBRARY_PATH` (`DT_RUNPATH`).
    pub runpath: Option<String>,
    /// The symbols that it defines for a whole process (`STB_GNU_UNIQUE`), with the bytes of those that nobody can change.
    pub unique: BTreeMap<String, Option<Vec<u8>>>,
    /// Whether it calls Python.
    pub calls_python: bool,
}

impl ElfLinkInfo {
    /// Reads a library of this machine; nothing when it is none, or its tables are broken.
    pub fn read(path: &Path) -> Option<Self> {
        let about = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
        let library = ElfReader::open(File::open(path).ok()?, about.len())?;
        let mut object = ElfLinkInfo::default();
        library.read_dynamic(&mut object)?;
        library.read_symbols(&mut object);
        Some(object)
    }
}

/// The names of the functions that a library has for others.
pub(crate) fn defined_functions(path: &Path) -> Vec<String> {
    let read = || {
        let library = ElfReader::open(File::open(path).ok()?, std::fs::metadata(path).ok()?.len())?;
        let (table, texts) = library.section_and_strings(SHT_DYNSYM)?;
        let texts = StringTable::new(&*texts, 0, texts.len() as u64);
        let symbols = slice_from_all_bytes::<Symbol>(&table).ok()?;
        let defined = symbols.iter().filter(|symbol| !symbol.is_undefined(library.endian));
        let names = defined.filter_map(|symbol| symbol.name(library.endian, texts).ok());
        Some(names.map(|name| String::from_utf8_lossy(name).into_owned()).collect())
    };
    read().unwrap_or_default()
}

/// A file of which only some tables are read: it may be as long as the memory.
struct ElfReader {
    file: File,
    length: u64,
    endian: Endianness,
    /// The bytes of the table of sections.
    sections: Vec<u8>,
}

impl ElfReader {
    fn open(file: File, length: u64) -> Option<Self> {
        let mut library = ElfReader { file, length, endian: Endianness::default(), sections: Vec::new() };
        let head = library.read_bytes(0, size_of::<Header>() as u64)?;
        let header = Header::parse(&*head).ok()?;
        library.endian = header.endian().ok()?;
        let count = u64::from(header.e_shnum(library.endian));
        let begin = header.e_shoff(library.endian);
        library.sections = library.read_bytes(begin, count * size_of::<Section>() as u64)?;
        Some(library)
    }

    fn read_bytes(&self, begin: u64, size: u64) -> Option<Vec<u8>> {
        let fits = size <= LONGEST && begin.checked_add(size)? <= self.length;
        let mut bytes = vec![0; usize::try_from(size).ok().filter(|_| fits)?];
        self.file.read_exact_at(&mut bytes, begin).ok()?;
        Some(bytes)
    }

    fn section_headers(&self) -> &[Section] {
        slice_from_all_bytes(&self.sections).unwrap_or_default()
    }

    /// The section of a kind, and the texts that it refers to.
    fn section_and_strings(&self, kind: elf::SectionType) -> Option<(Vec<u8>, Vec<u8>)> {
        let sections = self.section_headers();
        let section = sections.iter().find(|section| section.sh_type(self.endian) == kind)?;
        let texts = sections.get(usize::try_from(section.sh_link(self.endian)).ok()?)?;
        Some((self.section_bytes(section)?, self.section_bytes(texts)?))
    }

    fn section_bytes(&self, section: &Section) -> Option<Vec<u8>> {
        self.read_bytes(section.sh_offset(self.endian), section.sh_size(self.endian))
    }

    fn read_dynamic(&self, object: &mut ElfLinkInfo) -> Option<()> {
        let (table, texts) = self.section_and_strings(SHT_DYNAMIC)?;
        let texts = StringTable::new(&*texts, 0, texts.len() as u64);
        for entry in slice_from_all_bytes::<<Header as FileHeader>::Dyn>(&table).ok()? {
            let tag = entry.d_tag(self.endian);
            if ![DT_NEEDED, DT_SONAME, DT_RPATH, DT_RUNPATH].contains(&tag) {
                continue;
            }
            let text = String::from_utf8_lossy(entry.string(self.endian, texts).ok()?).into_owned();
            match tag {
                DT_NEEDED => object.needed.push(text),
                DT_SONAME => object.soname = Some(text),
                DT_RPATH => object.rpath = Some(text),
                _ => object.runpath = Some(text),
            }
        }
        Some(())
    }

    fn read_symbols(&self, object: &mut ElfLinkInfo) -> Option<()> {
        let (table, texts) = self.section_and_strings(SHT_DYNSYM)?;
        let texts = StringTable::new(&*texts, 0, texts.len() as u64);
        for symbol in slice_from_all_bytes::<Symbol>(&table).ok()? {
            if symbol.st_bind() == STB_GNU_UNIQUE && !symbol.is_undefined(self.endian) {
                let name = symbol.name(self.endian, texts).ok()?;
                let name = String::from_utf8_lossy(name).into_owned();
                object.unique.insert(name, self.constant_symbol_bytes(symbol));
            } else if symbol.is_undefined(self.endian) && symbol.st_bind() != STB_WEAK {
                object.calls_python |= PYTHON.contains(&symbol.name(self.endian, texts).ok()?);
            }
        }
        Some(())
    }

    /// The bytes of a symbol in a section that is never written to.
    fn constant_symbol_bytes(&self, symbol: &Symbol) -> Option<Vec<u8>> {
        let endian = self.endian;
        let section = self.section_headers().get(usize::from(symbol.st_shndx(endian).0))?;
        if section.sh_flags(endian).contains(SHF_WRITE) || section.sh_type(endian) == SHT_NOBITS {
            return None;
        }
        let inside = symbol.st_value(endian).checked_sub(section.sh_addr(endian))?;
        let begin = section.sh_offset(endian).checked_add(inside)?;
        self.read_bytes(begin, symbol.st_size(endian))
    }
}
