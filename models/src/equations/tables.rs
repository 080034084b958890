//! Lookup tables: from points to expressions.

use std::sync::Arc;

use mops_core::StudyError;
use mops_data::DataFile;
use mops_language::{
    Quantity, Unit,
    expression::{Comparison, Equation, Form, Function, Node, Operator, unknown_function},
    files::{Files, OutsideFolder},
};

use super::definition::{Definition, HELP, path, under};
use super::options::{Between, EquationsOptions, Grid, Outside, Points, Table};

/// Values in coherent units, with their unit.
#[derive(Debug, Clone)]
struct Column {
    values: Vec<f64>,
    unit: Unit,
}

/// A lookup table with its points.
#[derive(Debug, Clone)]
struct Lookup {
    name: String,
    x: Column,
    /// Values, or the second argument.
    y: Column,
    /// Values for every `y`, and for every `x` in it.
    z: Option<(Vec<Vec<f64>>, Unit)>,
    between: Between,
    outside: Outside,
}

/// Replaces the lookups in a definition by their expressions.
///
/// # Errors
/// If a table is wrong, or if an expression calls one that does not exist.
pub(super) fn replace(
    definition: &mut Definition,
    options: &EquationsOptions,
    files: &dyn Files,
) -> Result<(), StudyError> {
    let lookups = options.tables.0.iter().map(|(name, table)| {
        Lookup::read(name, table, files).map_err(|mistake| under(&path(&["tables", name]), mistake))
    });
    let lookups: Vec<Lookup> = lookups.collect::<Result<_, _>>()?;
    for text in definition.texts_mut() {
        let has_lookup = |node: &Node| {
            let mut found = false;
            node.walk(&mut |node| found |= matches!(node.form, Form::Lookup(..)));
            found
        };
        let Equation { left, right } = &*text.equation;
        if !left.iter().chain([right]).any(has_lookup) {
            continue;
        }
        let mut equation = (*text.equation).clone();
        for side in equation.left.iter_mut().chain([&mut equation.right]) {
            replace_in(side, &lookups).map_err(|mistake| under(&text.path, mistake))?;
        }
        text.equation = Arc::new(equation);
    }
    Ok(())
}

fn replace_in(node: &mut Node, lookups: &[Lookup]) -> Result<(), StudyError> {
    let mut result = Ok(());
    node.replace(&mut |node| {
        let Form::Lookup(name, arguments) = &node.form else { return None };
        let mut arguments = arguments.clone();
        for argument in &mut arguments {
            if let Err(mistake) = replace_in(argument, lookups) {
                result = Err(mistake);
                return None;
            }
        }
        let wrong = |message: String| StudyError::here(message).at(node.span.start..node.span.start + name.len());
        let Some(lookup) = lookups.iter().find(|lookup| lookup.name == *name) else {
            let tables: Vec<&str> = lookups.iter().map(|lookup| lookup.name.as_str()).collect();
            let known = if tables.is_empty() { String::new() } else { format!("; tables: {}", tables.join(", ")) };
            result = Err(wrong(unknown_function(name) + &known).with_help(HELP));
            return None;
        };
        let wanted = if lookup.z.is_some() { 2 } else { 1 };
        if arguments.len() != wanted {
            let fact = format!("the table `{name}` has {wanted} argument{}", if wanted == 1 { "" } else { "s" });
            result = Err(wrong(format!("{fact}, not {}", arguments.len())));
            return None;
        }
        Some(lookup.expression(&arguments, &node.span).form)
    });
    result
}

impl Lookup {
    fn read(name: &str, table: &Table, files: &dyn Files) -> Result<Self, StudyError> {
        let file = table.file.as_ref().map(|file| open(file, files)).transpose()?;
        let column = |key: &str, points: &Points| match (points, &file) {
            (Points::Values(values), _) => values_of(key, values),
            (Points::Column(name), Some(file)) => column_of(key, file, name),
            (Points::Column(_), None) => Err(StudyError::new(key, "the table has no file, so that it has no columns")
                .with_help("add `file`, or write a list of values")),
        };
        let (mut x, mut y) = (column("x", &table.x)?, column("y", &table.y)?);
        let z = match (&table.z, &file) {
            (None, _) => None,
            (Some(Grid::Rows(rows)), _) => {
                let mut columns = Vec::new();
                for row in rows {
                    columns.push(values_of("z", row)?);
                }
                let unit = columns.first().map_or_else(Unit::one, |column| column.unit.clone());
                Some((columns.into_iter().map(|column| column.values).collect(), unit))
            }
            (Some(Grid::Column(name)), Some(file)) => {
                let z = column_of("z", file, name)?;
                let (grid, rows) = gridded([&x.values, &y.values], &z.values)?;
                [x.values, y.values] = grid;
                Some((rows, z.unit))
            }
            (Some(Grid::Column(_)), None) => {
                return Err(StudyError::new("z", "the table has no file, so that it has no columns")
                    .with_help("add `file`, or write rows of values"));
            }
        };
        let rising = |key: &str, column: &Column| match column.values.windows(2).find(|pair| pair[1] <= pair[0]) {
            Some(pair) => {
                let fact = format!("the points must increase, but {} follows {}", pair[1], pair[0]);
                Err(StudyError::new(key, fact).with_help("sort the points, and remove duplicates"))
            }
            None if column.values.len() < 2 => Err(StudyError::new(key, "a table needs at least two points")),
            None => Ok(()),
        };
        rising("x", &x)?;
        match &z {
            None if y.values.len() != x.values.len() => {
                let fact = format!("`x` has {} points and `y` has {}", x.values.len(), y.values.len());
                return Err(StudyError::new("y", fact).with_help("give one value for each point"));
            }
            None => {}
            Some((rows, _)) => {
                rising("y", &y)?;
                let fits = rows.len() == y.values.len() && rows.iter().all(|row| row.len() == x.values.len());
                if !fits {
                    let wanted = format!("{} rows of {} values", y.values.len(), x.values.len());
                    return Err(StudyError::new("z", format!("expected {wanted}, one row for every `y`")));
                }
                if table.between == Between::Monotone {
                    return Err(StudyError::new("between", "a monotone spline has one argument")
                        .with_help("use between = \"linear\""));
                }
            }
        }
        let all = x.values.iter().chain(&y.values).chain(z.iter().flat_map(|(rows, _)| rows.iter().flatten()));
        if all.clone().any(|value| !value.is_finite()) {
            return Err(
                StudyError::here("a value of the table is missing or not finite").with_help("complete the data")
            );
        }
        Ok(Self { name: name.to_owned(), x, y, z, between: table.between, outside: table.outside })
    }

    /// Returns the expression of the table at its arguments.
    fn expression(&self, arguments: &[Node], span: &std::ops::Range<usize>) -> Node {
        let node = |form: Form| Node { form, span: span.clone() };
        let quantity = |value: f64, unit: &Unit| node(Form::Quantity(value, coherent(unit)));
        let argument = |index: usize, points: &Column| match self.outside {
            Outside::Extend => arguments[index].clone(),
            Outside::Constant => {
                let [low, high] = [points.values[0], points.values[points.values.len() - 1]];
                let limits = [low, high].map(|value| quantity(value, &points.unit));
                node(Form::Call(Function::Clip, std::iter::once(arguments[index].clone()).chain(limits).collect()))
            }
        };
        let x = argument(0, &self.x);
        let linear = |at: &Node, points: &Column, values: Vec<Node>| {
            let pairs = points.values.iter().zip(values).flat_map(|(x, y)| [quantity(*x, &points.unit), y]);
            node(Form::Call(Function::Table, std::iter::once(at.clone()).chain(pairs).collect()))
        };
        let values = |row: &[f64], unit: &Unit| row.iter().map(|value| quantity(*value, unit)).collect::<Vec<_>>();
        match (&self.z, self.between) {
            (None, Between::Linear) => linear(&x, &self.x, values(&self.y.values, &self.y.unit)),
            (Some((rows, unit)), _) => {
                let of_rows = rows.iter().map(|row| linear(&x, &self.x, values(row, unit))).collect();
                linear(&argument(1, &self.y), &self.y, of_rows)
            }
            (None, Between::Monotone) => self.spline(&x, span),
        }
    }

    /// Returns the monotone cubic spline, with straight lines beyond its ends.
    ///
    /// Source: F. N. Fritsch, R. E. Carlson, Monotone piecewise cubic interpolation, SIAM Journal on Numerical Analysis
    /// 17 (1980) 238-246; slopes at the points: F. N. Fritsch, J. Butland, A method for constructing local monotone
    /// piecewise cubic interpolants, SIAM Journal on Scientific and Statistical Computing 5 (1984) 300-304.
    fn spline(&self, at: &Node, span: &std::ops::Range<usize>) -> Node {
        let node = |form: Form| Node { form, span: span.clone() };
        let (x, y) = (&self.x.values, &self.y.values);
        let slopes = slopes(x, y);
        // Unit of the coefficient of a power.
        let unit = |power: i32| Unit::product(&[(&coherent(&self.y.unit), 1), (&coherent(&self.x.unit), -power)]);
        let point = |k: usize| node(Form::Quantity(x[k], coherent(&self.x.unit)));
        let polynomial = |k: usize, coefficients: &[f64]| {
            let from = node(Form::Chain(Box::new(at.clone()), vec![(Operator::Subtract, point(k))]));
            let term = |power: usize| {
                let coefficient = node(Form::Quantity(coefficients[power], unit(power as i32)));
                let factors = (0..power).map(|_| (Operator::Multiply, from.clone())).collect();
                if power == 0 { coefficient } else { node(Form::Chain(Box::new(coefficient), factors)) }
            };
            let rest = (1..coefficients.len()).map(|power| (Operator::Add, term(power))).collect();
            node(Form::Chain(Box::new(term(0)), rest))
        };
        let last = x.len() - 1;
        let mut branches = Vec::new();
        let mut branch = |end: usize, value: Node| {
            branches.push(node(Form::Compare(Comparison::Less, Box::new(at.clone()), Box::new(point(end)))));
            branches.push(value);
        };
        branch(0, polynomial(0, &[y[0], slopes[0]]));
        for k in 0..last {
            let h = x[k + 1] - x[k];
            let secant = (y[k + 1] - y[k]) / h;
            let square = (3.0 * secant - 2.0 * slopes[k] - slopes[k + 1]) / h;
            let cube = (slopes[k] + slopes[k + 1] - 2.0 * secant) / (h * h);
            branch(k + 1, polynomial(k, &[y[k], slopes[k], square, cube]));
        }
        branches.push(polynomial(last, &[y[last], slopes[last]]));
        node(Form::Call(Function::If, branches))
    }
}

/// Returns the slopes of the monotone spline at its points: weighted harmonic means of the secants, 0 at extrema;
/// secants at the ends.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let secant = |k: usize| (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
    let last = x.len() - 1;
    (0..=last)
        .map(|k| {
            if k == 0 || k == last {
                return secant(k.min(last - 1));
            }
            let [before, after] = [secant(k - 1), secant(k)];
            if before * after <= 0.0 {
                return 0.0;
            }
            let [left, right] = [x[k] - x[k - 1], x[k + 1] - x[k]];
            let [a, b] = [2.0 * right + left, right + 2.0 * left];
            (a + b) / (a / before + b / after)
        })
        .collect()
}

fn coherent(unit: &Unit) -> Unit {
    Unit::coherent(unit.dimension())
}

fn open(path: &str, files: &dyn Files) -> Result<DataFile, StudyError> {
    let shown = files.show(path);
    let bytes = files.read(path).map_err(|error| {
        let help = match OutsideFolder::is_reason_of(&error) {
            true => OutsideFolder::HELP,
            false => "paths are relative to the folder of the study file",
        };
        StudyError::new("file", format!("the data file `{shown}` cannot be read: {error}")).with_help(help)
    })?;
    DataFile::parse(&shown, bytes).map_err(|diagnostic| {
        let mistake = StudyError::new("file", format!("in `{shown}`: {}", diagnostic.message));
        diagnostic.help.iter().fold(mistake, |mistake, help| mistake.with_help(help))
    })
}

fn column_of(key: &str, file: &DataFile, name: &str) -> Result<Column, StudyError> {
    let column = file.column(name).map_err(|diagnostic| {
        let mistake = StudyError::new(key, diagnostic.message);
        diagnostic.help.iter().fold(mistake, |mistake, help| mistake.with_help(help))
    })?;
    let unit = column.unit.map_or(Ok(Unit::one()), Unit::parse).map_err(|why| StudyError::new(key, why))?;
    let values = column.values.iter().map(|value| value * unit.factor() + unit.zero()).collect();
    Ok(Column { values, unit })
}

/// Returns values in coherent units; all have the dimension of the first one with a unit.
fn values_of(key: &str, values: &[Quantity]) -> Result<Column, StudyError> {
    let unit = values.iter().find_map(|value| value.unit.clone()).unwrap_or_else(Unit::one);
    let si = coherent(&unit);
    let value = |value: &Quantity| value.to(&si).map_err(|why| StudyError::new(key, why));
    Ok(Column { values: values.iter().map(value).collect::<Result<_, _>>()?, unit })
}

/// Distinct values of both arguments, and the values of the table for every pair.
type Gridded = ([Vec<f64>; 2], Vec<Vec<f64>>);

/// Returns the grid of a table whose file has one row for every pair of arguments.
fn gridded([x, y]: [&[f64]; 2], z: &[f64]) -> Result<Gridded, StudyError> {
    let distinct = |values: &[f64]| {
        let mut values: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let (columns, rows) = (distinct(x), distinct(y));
    let mut grid = vec![vec![f64::NAN; columns.len()]; rows.len()];
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        let place = |list: &[f64], value: f64| list.iter().position(|known| *known == value);
        if let (Some(column), Some(row)) = (place(&columns, *x), place(&rows, *y)) {
            grid[row][column] = *z;
        }
    }
    if grid.iter().flatten().any(|value| value.is_nan()) {
        let fact =
            format!("the file lacks values for some of the {} x {} pairs of `x` and `y`", columns.len(), rows.len());
        return Err(StudyError::new("z", fact).with_help("give a value for every pair"));
    }
    Ok(([columns, rows], grid))
}
