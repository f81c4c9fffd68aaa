//! Writes random tables and reads them back with fmi-rs.

use fmi_rs::model_description::fmi2::{self, ModelDescription, VariableType};

use super::*;
use crate::table::table_problems;
use crate::unit::Unit;
use crate::{calculated_parameter, constant, independent, input, local, output, parameter};

/// Members for variables of each type.
struct Zoo {
    real: [f64; 2],
    integer: [i32; 2],
    boolean: bool,
    text: String,
}

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % end as u64) as usize
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    fn number(&mut self) -> f64 {
        let mantissa = self.below(20_001) as f64 - 1e4;
        mantissa * 10_f64.powi(self.below(9) as i32 - 6) / 3.0
    }
}

const UNITS: &[&str] = &["", "1", "rad", "m/s", "K", "Pa", "N.m/rad", "kg.m2", "km/h", "degC", "%"];
const NAMES: &[&str] = &["a", "tire_f.B", "x[1,2].y", "der(v)", r#"'odd & \"<name>\"'"#, "_1"];
const TEXTS: &[&str] = &["", "100 % <ok> & \"fine\"", "ä\u{1F697}", "two\nlines\ttab", "'"];

/// A row of one of the legal combinations of FMI 2.0, section 2.2.7.
fn legal_row(random: &mut Random, name: &'static str, clock: bool) -> (VariableRow, bool) {
    let description = random.of(TEXTS);
    let make = if clock {
        independent
    } else {
        random.of(&[input, output, parameter, calculated_parameter, local, constant])
    };
    let row = make(name, "", description);
    let row = match row.causality {
        Causality::Independent => return (row, true),
        Causality::Input => random.of(&[row, row.discrete(), row.optional()]),
        Causality::Parameter => random.of(&[row, row.tunable()]),
        Causality::CalculatedParameter => {
            random.of(&[row, row.tunable(), row.approx(), row.tunable().approx()])
        }
        _ if row.variability == Variability::Constant => row,
        Causality::Local if random.flip() => {
            random.of(&[row.fixed(), row.tunable().approx(), row.fixed().approx()])
        }
        _ => {
            let row = random.of(&[row, row.discrete(), row.constant()]);
            if row.variability == Variability::Constant {
                row
            } else {
                random.of(&[row, row.exact(), row.approx(), row.calculated()])
            }
        }
    };
    (row, false)
}

fn variable(random: &mut Random, name: &'static str, clock: bool, zoo: &Zoo) -> Variable<Zoo> {
    let (mut row, real) = legal_row(random, name, clock);
    let second = random.flip();
    match if real { 0 } else { random.below(4) } {
        0 => {
            let value = zoo.real[usize::from(second)];
            row.unit = random.of(UNITS);
            if row.unit == "m/s" && random.flip() {
                row = row.display(random.of(&["mph", "m/s", "km/h"]));
            }
            if random.flip() {
                row = row.min(value - random.number().abs()).max(value).nominal(1e3);
            }
            if second { row.at(|zoo| &mut zoo.real[1]) } else { row.at(|zoo| &mut zoo.real[0]) }
        }
        1 => {
            if random.flip() {
                row = row.min(f64::from(i32::MIN)).max(f64::from(i32::MAX));
            }
            match second {
                true => row.at_integer(|zoo| &mut zoo.integer[1]),
                false => row.at_integer(|zoo| &mut zoo.integer[0]),
            }
        }
        2 => row.at_boolean(|zoo| &mut zoo.boolean),
        _ => row.at_string(|zoo| &mut zoo.text),
    }
}

fn leak<T>(value: Vec<T>) -> &'static [T] {
    value.leak()
}

/// A random table, in which some outputs depend on some inputs.
fn table(random: &mut Random) -> (Vec<Variable<Zoo>>, Zoo) {
    let zoo = Zoo {
        real: [random.number(), random.number()],
        integer: [random.below(1000) as i32 - 500, i32::MAX],
        boolean: random.flip(),
        text: random.of(TEXTS).to_owned(),
    };
    let count = random.below(12) + 1;
    let clock = random.below(2 * count);
    let names = (0..count).map(|i| match NAMES.get(i) {
        Some(name) => *name,
        None => &*format!("more[{i}]").leak(),
    });
    let mut variables: Vec<_> =
        names.enumerate().map(|(i, name)| variable(random, name, i == clock, &zoo)).collect();
    let inputs: Vec<_> = variables
        .iter()
        .filter(|variable| variable.row.causality == Causality::Input && random.flip())
        .map(|variable| variable.row.name)
        .collect();
    let inputs = leak(inputs);
    for Variable { row, .. } in &mut variables {
        if row.causality == Causality::Output && random.flip() {
            *row = row.depends_on(inputs);
        }
    }
    (variables, zoo)
}

fn number(text: &Option<String>) -> Option<f64> {
    text.as_ref().map(|text| text.parse().expect("a number"))
}

/// What a variable of the table should look like to a reader.
fn assert_equal(found: &fmi2::ScalarVariable, variable: &Variable<Zoo>, zoo: &mut Zoo) {
    let Variable { row, access } = variable;
    assert_eq!(found.name, row.name);
    assert_eq!(found.description.as_deref(), Some(row.description));
    assert_eq!(format!("{:?}", found.causality), format!("{:?}", row.causality));
    assert_eq!(format!("{:?}", found.variability), format!("{:?}", row.variability));
    // fmi-rs gives inputs the initial that the standard implies.
    let initial = if row.causality == Causality::Input { Some(Initial::Exact) } else { row.initial };
    assert_eq!(format!("{:?}", found.initial), format!("{initial:?}"));
    assert_eq!(found.variableType.name(), format!("{:?}", access.kind()));
    let start = match access {
        VariableAccess::Real(at) => at(zoo).to_string(),
        VariableAccess::Integer(at) => at(zoo).to_string(),
        VariableAccess::Boolean(at) => at(zoo).to_string(),
        VariableAccess::String(at) => at(zoo).clone(),
    };
    assert_eq!(*found.variableType.start(), row.has_start().then_some(start));
    match &found.variableType {
        VariableType::Real { unit, displayUnit, min, max, nominal, .. } => {
            assert_eq!(unit.as_deref().unwrap_or_default(), row.unit);
            assert_eq!(displayUnit.as_deref(), display_unit(row));
            assert_eq!([min, max, nominal].map(number), [row.min, row.max, row.nominal]);
        }
        VariableType::Integer { min, max, .. } => {
            assert_eq!([min, max].map(number), [row.min, row.max]);
            assert!([min, max].into_iter().flatten().all(|limit| limit.parse::<i32>().is_ok()));
        }
        _ => {}
    }
}

fn assert_structure(read: &ModelDescription, variables: &[Variable<Zoo>]) {
    let index = |name: &str| {
        let index = variables.iter().position(|variable| variable.row.name == name);
        index.expect("a variable") as u32 + 1
    };
    let outputs = variables.iter().filter(|variable| variable.row.causality == Causality::Output);
    let outputs: Vec<_> = outputs.map(|variable| &variable.row).collect();
    assert_eq!(read.outputs.len(), outputs.len());
    for (unknown, row) in read.outputs.iter().zip(outputs) {
        assert_eq!(unknown.index, index(row.name));
        let expected = match row.depends {
            OutputDependencies::All => None,
            OutputDependencies::On(names) => Some(names.iter().map(|name| index(name)).collect::<Vec<_>>()),
        };
        assert_eq!(unknown.dependencies, expected);
    }
}

fn assert_units(read: &ModelDescription) {
    for unit in &read.unitDefintions {
        let expected = Unit::parse(&unit.name).expect("a unit");
        let base = unit.baseUnit.as_ref().expect("a base unit");
        let exponents = [base.kg, base.m, base.s, base.A, base.K, base.mol, base.cd, base.rad];
        assert_eq!(exponents, expected.exponents.map(i32::from));
        assert_eq!((base.factor, base.offset), (expected.factor, expected.offset));
        for display in &unit.displayUnits {
            let to = Unit::parse(&display.name).expect("a unit");
            let conversion = Unit::conversion(&expected, &to);
            assert_eq!(Some((display.factor, display.offset)), conversion);
        }
    }
}

#[test]
fn any_legal_table_reads_back_equal_and_valid() {
    let mut random = Random(2);
    // Miri takes minutes for what a processor does in a second.
    for _ in 0..if cfg!(miri) { 3 } else { 1000 } {
        let (variables, mut zoo) = table(&mut random);
        assert_eq!(table_problems(&variables, &mut zoo), Vec::<String>::new());
        let info = Info::new("zoo", random.of(TEXTS), 0.01).stop(random.number().abs() + 1.0);
        let info = info.tolerance(1e-6).author("A & B").log_categories(&[("logZoo", "<animals>")]);
        let table = DescriptionTable::of_variables(info, &variables, &mut zoo, random.flip());
        let text = table.fmi2_description_xml("{0}");
        let read = ModelDescription::from_string(&text).expect(&text);
        let found: Vec<_> = read.validate().into_iter().map(|problem| problem.message).collect();
        assert_eq!(found, Vec::<String>::new(), "{text}");
        for (i, (found, variable)) in read.modelVariables.iter().zip(&variables).enumerate() {
            assert_eq!(found.valueReference as usize, i);
            assert_equal(found, variable, &mut zoo);
        }
        assert_eq!(read.modelVariables.len(), variables.len());
        assert_structure(&read, &variables);
        assert_units(&read);
        let experiment = read.defaultExperiment.expect("an experiment");
        assert_eq!(number(&experiment.stopTime), info.stop);
        assert_eq!((number(&experiment.stepSize), number(&experiment.tolerance)), (Some(0.01), Some(1e-6)));
        assert_eq!(read.logCategories.last().map(|category| &*category.name), Some("logZoo"));
        let library = read.coSimulation.expect("co-simulation");
        assert_eq!(library.providesDirectionalDerivative, table.capabilities.differentiable);
        assert!(library.canInterpolateInputs && library.maxOutputDerivativeOrder == 0);
    }
}

#[test]
fn combinations_that_fmi_does_not_allow_are_reported() {
    let assert_reported = |variable: Variable<Zoo>, part: &str| {
        let mut zoo = Zoo { real: [f64::NAN, 1.0], integer: [0, 1], boolean: true, text: String::new() };
        let problems = table_problems(&[variable], &mut zoo).join("; ");
        assert!(problems.contains(part), "expected {part:?}, found {problems:?}");
    };
    let (x, illegal) = (output("x", "m", ""), "cannot be");
    for row in [
        input("x", "", "").constant(),
        input("x", "", "").fixed(),
        input("x", "", "").exact(),
        parameter("x", "", "").discrete(),
        parameter("x", "", "").calculated(),
        parameter("x", "", "").constant(),
        calculated_parameter("x", "", "").exact(),
        calculated_parameter("x", "", "").discrete(),
        x.fixed(),
        x.tunable(),
        x.constant().calculated(),
        local("x", "", "").fixed().exact(),
        independent("x", "s", "").discrete(),
        independent("x", "s", "").exact(),
    ] {
        assert_reported(row.at(|zoo| &mut zoo.real[1]), illegal);
    }
    assert_reported(independent("t", "", "").at_integer(|zoo| &mut zoo.integer[0]), illegal);
    assert_reported(x.at_integer(|zoo| &mut zoo.integer[0]), "has no unit");
    assert_reported(output("x", "", "").min(0.0).at_boolean(|zoo| &mut zoo.boolean), "no limits");
    assert_reported(output("x", "", "").min(0.5).at_integer(|zoo| &mut zoo.integer[0]), "32-bit");
    assert_reported(output("x", "", "").nominal(1.0).at_integer(|zoo| &mut zoo.integer[0]), "no nominal");
    assert_reported(x.min(2.0).max(1.0).at(|zoo| &mut zoo.real[1]), "no value");
    assert_reported(x.max(f64::INFINITY).at(|zoo| &mut zoo.real[1]), "not finite");
    assert_reported(x.nominal(0.0).at(|zoo| &mut zoo.real[1]), "not positive");
    assert_reported(x.exact().at(|zoo| &mut zoo.real[0]), "outside");
    assert_reported(x.exact().min(2.0).at(|zoo| &mut zoo.real[1]), "outside");
    assert_reported(x.display("s").at(|zoo| &mut zoo.real[1]), "cannot be shown in s");
    assert_reported(x.display("furlong").at(|zoo| &mut zoo.real[1]), "furlong");
    assert_reported(x.depends_on(&["u"]).at(|zoo| &mut zoo.real[1]), "`u`, which is no input");
    for name in ["", "1a", "a b", "a.", "a[x]", "a[1", "der(a", "'a", "a..b", "''", "ä"] {
        assert_reported(output(name, "", "").at(|zoo| &mut zoo.real[1]), "structured name");
    }
}
