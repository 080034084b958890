//! Lookup tables against their points, polynomials and files.

use std::io;

use mops_language::files::Files;

use super::*;

/// Files by name.
struct Data(&'static [(&'static str, &'static str)]);

impl Files for Data {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let found = self.0.iter().find(|(name, _)| *name == path);
        found.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

const FILES: Data = Data(&[
    ("motor.csv", "speed[rpm],torque[mN m]\n0,100\n60,80\n120,0\n"),
    ("map.csv", "w,T,eta\n0,0,1\n1,0,2\n0,10,5\n1,10,8\n"),
    ("holed.csv", "w,T,eta\n0,0,1\n1,0,2\n0,10,5\n"),
]);

fn with_table(table: &str, output: &str) -> Result<Equations, StudyError> {
    let text = format!(
        "states = {{ x = 'rad/s' }}\nder = {{ x = '1 [rad/s2]' }}\nstart = {{ x = -1 }}\noutputs = {{ y = \"{output}\" }}\n\
         tables.f = {table}{TIGHT}"
    );
    let options = toml::from_str::<EquationsOptions>(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    equations::Equations::with_files(&options, &FILES).map(Simulated::new)
}

/// Returns `y` where `x`, in rad/s, has these values.
fn at(table: &str, output: &str, x: &[f64]) -> Vec<f64> {
    let model = with_table(table, output).unwrap_or_else(|e| panic!("{e}"));
    let index = model.interface().signals.iter().position(|s| s.name == "y").unwrap();
    let parameters: Vec<f64> = model.interface().parameters.iter().map(|p| p.default.unwrap_or(-1.0)).collect();
    let job = Job { case: &Case::default(), parameters: &parameters, signals: &[index], horizon: 20.0 };
    let analysis = model.analyse(&job).unwrap();
    x.iter().map(|x| analysis.trace("y").at(x + 1.0)).collect()
}

fn near(found: &[f64], expected: &[f64]) {
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?} {expected:?}");
}

#[test]
fn a_table_from_a_file_is_linear_between_its_points_in_any_unit() {
    // 60 rpm are 2 pi rad/s.
    let turn = std::f64::consts::TAU;
    let x = [-0.5 * turn / 6.0, 0.0, 0.25 * turn, turn, 1.5 * turn, 2.5 * turn];
    let table = "{ file = 'motor.csv', x = 'speed', y = 'torque' }";
    near(&at(table, "f(x)", &x), &[0.1 + 0.02 / 12.0, 0.1, 0.095, 0.08, 0.04, -0.04]);
    let constant = "{ file = 'motor.csv', x = 'speed', y = 'torque', outside = 'constant' }";
    near(&at(constant, "f(x)", &x), &[0.1, 0.1, 0.095, 0.08, 0.04, 0.0]);
    let given = "{ x = [0, '60 rpm', '120 rpm'], y = ['100 mN m', '80 mN m', 0] }";
    near(&at(given, "2*f(x)", &x), &[0.2 + 0.02 / 6.0, 0.2, 0.19, 0.16, 0.08, -0.08]);
}

#[test]
fn a_monotone_spline_passes_through_its_points_without_extrema_between_them() {
    let table = "{ x = [0, '1 rad/s', '2 rad/s', '4 rad/s'], y = [0, 0, 1, 1.5], between = 'monotone' }";
    near(&at(table, "f(x)", &[0.0, 1.0, 2.0, 4.0]), &[0.0, 0.0, 1.0, 1.5]);
    let x: Vec<f64> = (0..=400).map(|k| 0.01 * f64::from(k)).collect();
    let y = at(table, "f(x)", &x);
    assert!(y.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9), "it rises");
    // The slope has no jump: second differences stay of the order of the step squared.
    let bends = y.windows(3).map(|y| (y[0] - 2.0 * y[1] + y[2]).abs()).fold(0.0, f64::max);
    assert!(bends < 10.0 * 1e-4, "{bends}");
    // Slope at the inner point 2: weighted harmonic mean of the secants 1 and 1/4 (weights 2*2 + 1 and 2 + 2*1).
    let slope = 9.0 / (5.0 / 1.0 + 4.0 / 0.25);
    let found = (at(table, "f(x)", &[2.001])[0] - at(table, "f(x)", &[1.999])[0]) / 0.002;
    assert!((found - slope).abs() < 2e-3, "{found} {slope}");
    // A straight line stays one.
    let line = "{ x = [0, '1 rad/s', '3 rad/s'], y = [1, 3, 7], between = 'monotone' }";
    near(&at(line, "f(x)", &[-0.5, 0.3, 2.2, 5.0]), &[0.0, 1.6, 5.4, 11.0]);
}

#[test]
fn a_table_of_two_arguments_is_bilinear() {
    let z = |w: f64, t: f64| 1.0 + w + 0.4 * t + 0.2 * w * t;
    let x = [0.0, 0.3, 1.0, 1.5];
    let expected: Vec<f64> = x.iter().map(|w| z(*w, 4.0)).collect();
    let table = "{ file = 'map.csv', x = 'w', y = 'T', z = 'eta' }";
    near(&at(table, "f(x/1 [rad/s], 4)", &x), &expected);
    let rows = "{ x = [0, '1 rad/s'], y = [0, 10], z = [[1, 2], [5, 8]] }";
    near(&at(rows, "f(x, 4)", &x), &expected);
}

#[test]
fn a_wrong_table_and_a_table_that_does_not_exist_are_refused() {
    for (table, output, place, fact) in [
        ("{ x = [0, 1], y = [0, 1, 2] }", "f(x/1 [rad/s])", "tables.f.y", "2 points and `y` has 3"),
        ("{ x = [0, 0], y = [0, 1] }", "f(1)", "tables.f.x", "must increase"),
        ("{ x = [0], y = [0] }", "f(1)", "tables.f.x", "at least two points"),
        ("{ x = 'a', y = [0, 1] }", "f(1)", "tables.f.x", "has no file"),
        ("{ file = 'none.csv', x = 'a', y = 'b' }", "f(1)", "tables.f.file", "cannot be read"),
        ("{ file = 'motor.csv', x = 'sped', y = 'torque' }", "f(1)", "tables.f.x", "no column `sped`"),
        ("{ file = 'holed.csv', x = 'w', y = 'T', z = 'eta' }", "f(1, 2)", "tables.f.z", "lacks values"),
        ("{ x = [0, 1], y = [0, 1], z = [[1, 2]] }", "f(1, 2)", "tables.f.z", "expected 2 rows"),
        (
            "{ x = [0, 1], y = [0, 1], z = [[1, 2], [3, 4]], between = 'monotone' }",
            "f(1, 2)",
            "between",
            "one argument",
        ),
        ("{ x = [0, 1], y = [0, 1] }", "f(1, 2)", "outputs.y", "has 1 argument, not 2"),
        ("{ x = [0, 1], y = [0, 1] }", "g(x)", "outputs.y", "unknown function `g`"),
        ("{ x = [0, 1], y = [0, 1] }", "f(x)", "outputs.y", "same dimension"),
    ] {
        let mistake = with_table(table, output).err().unwrap_or_else(|| panic!("{table} {output}")).to_string();
        assert!(mistake.contains(place) && mistake.contains(fact), "{table} {output}: {mistake}");
    }
}
