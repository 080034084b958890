//! Measured frequency responses of a study file: from columns to complex numbers over angular frequencies.

use mops_core::{
    case::ResponseData,
    study::{CaseBuilder, Measured},
};
use mops_data::DataFile;
use mops_language::{Diagnostic, Unit};
use mops_math as math;

use super::columns::{column_at, entry, unit_of_header};
use super::reading::read_unit;
use super::sections::{ExperimentSection, ResponseTable};
use super::tree::Node;

/// Reads an experiment with frequency responses.
pub(super) fn read(
    name: String,
    node: &Node<'_>,
    section: &ExperimentSection,
    file: &DataFile,
) -> Result<CaseBuilder, Diagnostic> {
    for (key, is_there) in [("channels", !section.channels.0.is_empty()), ("inputs", !section.inputs.0.is_empty())] {
        if let (true, Some(place)) = (is_there, node.child(key)) {
            return Err(place
                .key_diagnostic(format!("`{key}` are measured over time, `responses` over frequency"))
                .with_help("use separate experiments"));
        }
    }
    let Some(column) = &section.frequency else {
        let place = node.child("responses").expect("it was just read");
        return Err(place
            .key_diagnostic("the responses have no frequency column".to_owned())
            .with_help("set frequency = \"...\" to the name of the column"));
    };
    let place = node.child("frequency").expect("it was just read");
    let frequencies = frequencies(node, &place, column, section, file)?;
    let mut responses = Vec::new();
    for (signal, table) in &section.responses.0 {
        let place = entry(node, "responses", signal);
        let (values, unit) = values(&place, table, file)?;
        if values.len() != frequencies.len() {
            let fact = format!(
                "the response has {} samples, but the frequency column `{column}` has {}",
                values.len(),
                frequencies.len()
            );
            return Err(place.key_diagnostic(fact).with_help("both must come from the same rows of the file"));
        }
        let kept = frequencies.iter().zip(&values).filter(|(_, v)| v.iter().all(|x| x.is_finite()));
        let (frequencies, values): (Vec<f64>, Vec<[f64; 2]>) = kept.map(|(f, v)| (*f, *v)).unzip();
        if frequencies.is_empty() {
            return Err(place
                .key_diagnostic(format!("all samples of `{signal}` are missing"))
                .with_help("choose other columns"));
        }
        responses.push(ResponseData { signal: signal.clone(), frequencies, values, unit });
    }
    let measured = Measured { responses, role: section.role, ..Measured::default() };
    Ok(CaseBuilder {
        name,
        parameters: section.parameters.0.clone(),
        measured: Some(measured),
        ..CaseBuilder::default()
    })
}

/// Returns the frequencies, rad/s.
fn frequencies<'t>(
    node: &Node<'t>,
    place: &Node<'t>,
    name: &str,
    section: &ExperimentSection,
    file: &DataFile,
) -> Result<Vec<f64>, Diagnostic> {
    let column = column_at(place, file, name)?;
    let unit = match (&section.frequency_unit, column.unit) {
        (Some(unit), _) => read_unit(node, "frequency-unit", unit)?,
        (None, Some(unit)) => unit_of_header(place, file, name, unit, "frequency-unit")?,
        (None, None) => Unit::known("rad/s"),
    };
    let factor = unit.factor_to(&Unit::known("rad/s")).ok_or_else(|| {
        let place = node.child("frequency-unit").unwrap_or_else(|| place.clone());
        place
            .diagnostic(format!("the frequency column `{name}` is in `{unit}`, which is not a unit of frequency"))
            .with_help("set frequency-unit = \"Hz\"")
    })?;
    if let Some(row) = column.values.iter().position(|f| !(f.is_finite() && *f >= 0.0)) {
        let fact = format!("sample {} of the frequency `{name}` is {}", row + 1, column.values[row]);
        return Err(Diagnostic::new(fact)
            .with_help("frequencies must be finite and not negative: delete or correct the row")
            .at(&file.source, file.span_of(name, row)));
    }
    Ok(column.values.iter().map(|f| f * factor).collect())
}

/// Returns the unit in the header of a real or imaginary part or a magnitude. `None` for no unit, or for 1, which is
/// the unit of the model.
fn unit_of(place: &Node<'_>, file: &DataFile, name: &str, unit: Option<&str>) -> Result<Option<Unit>, Diagnostic> {
    let Some(unit) = unit else { return Ok(None) };
    let parsed = Unit::parse(unit).map_err(|_| {
        let source = &file.source.name;
        place
            .diagnostic(format!("unknown unit `{unit}` of `{name}` in the header of {source}"))
            .with_help("use dB, the unit of the output divided by that of the input, or no unit in the header")
    })?;
    Ok((parsed.factor_to(&Unit::one()) != Some(1.0)).then_some(parsed))
}

type Values = (Vec<[f64; 2]>, Option<Unit>);

/// Returns real and imaginary parts, and their unit.
fn values(place: &Node<'_>, table: &ResponseTable, file: &DataFile) -> Result<Values, Diagnostic> {
    let at = |key: &str| place.child(key).expect("it was just read");
    match (&table.real, &table.imaginary, &table.magnitude, &table.phase) {
        (Some(real), Some(imaginary), None, None) => {
            let names = (real, imaginary);
            let real = column_at(&at("real"), file, real)?;
            let imaginary = column_at(&at("imaginary"), file, imaginary)?;
            let unit = unit_of(&at("real"), file, names.0, real.unit)?;
            if unit != unit_of(&at("imaginary"), file, names.1, imaginary.unit)? {
                return Err(place
                    .key_diagnostic(format!("`{}` and `{}` have different units", names.0, names.1))
                    .with_help("correct the units in the header of the file"));
            }
            Ok((real.values.iter().zip(imaginary.values).map(|(&re, &im)| [re, im]).collect(), unit))
        }
        (None, None, Some(magnitude), Some(phase)) => {
            let size = column_at(&at("magnitude"), file, magnitude)?;
            let decibel = table.decibel || size.unit == Some("dB");
            let in_unit = if decibel { None } else { unit_of(&at("magnitude"), file, magnitude, size.unit)? };
            let angle = column_at(&at("phase"), file, phase)?;
            let unit = match angle.unit {
                Some(unit) => unit_of_header(&at("phase"), file, phase, unit, "phase")?,
                None => Unit::known("deg"),
            };
            let factor = unit.factor_to(&Unit::known("rad")).ok_or_else(|| {
                at("phase")
                    .diagnostic(format!("the phase column `{phase}` is in `{unit}`, which is not a unit of angle"))
                    .with_help("choose another column, or correct the unit in the header of the file")
            })?;
            let polar = |(&size, &angle): (&f64, &f64)| {
                let size = if decibel { math::powf(10.0, size / 20.0) } else { size };
                let (sin, cos) = math::sin_cos(angle * factor);
                [size * cos, size * sin]
            };
            Ok((size.values.iter().zip(angle.values).map(polar).collect(), in_unit))
        }
        _ => Err(place
            .key_diagnostic(
                "a frequency response needs a real and an imaginary part, or magnitude and phase".to_owned(),
            )
            .with_help("as in { magnitude = \"mag\", phase = \"ph\" }, or { real = \"re\", imaginary = \"im\" }")),
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::super::Files;
    use super::super::tree::Text;
    use super::*;

    struct Data(&'static str);

    impl Files for Data {
        fn read(&self, _: &str) -> io::Result<Vec<u8>> {
            Ok(self.0.as_bytes().to_vec())
        }
        fn show(&self, path: &str) -> String {
            path.to_owned()
        }
    }

    fn responses(experiment: &str, data: &'static str) -> Result<Vec<ResponseData>, String> {
        let text = Text::new("study.toml", &format!("[e]\nfile = 'sweep.csv'\n{experiment}\n"), &[]);
        let root = text.parse().unwrap();
        let read = super::super::experiment::read("e", &root.child("e").unwrap(), &Data(data));
        read.map(|mut cases| cases.remove(0).measured.unwrap().responses).map_err(|diagnostic| diagnostic.to_string())
    }

    #[test]
    fn decibels_and_degrees_become_complex_numbers_over_angular_frequencies() {
        let data = "f [Hz],m [dB],p [deg],re,im\n1,20,90,0,10\n2,0,,1,0\n3,-20,180,-0.1,0\n";
        let polar = responses("frequency = 'f'\nresponses = { y = { magnitude = 'm', phase = 'p' } }", data).unwrap();
        let parts = responses("frequency = 'f'\nresponses = { y = { real = 're', imaginary = 'im' } }", data).unwrap();
        assert_eq!((polar[0].values.len(), parts[0].values.len()), (2, 3), "a missing sample is omitted");
        assert!((polar[0].frequencies[1] - 6.0 * std::f64::consts::PI).abs() < 1e-12);
        for (a, b) in polar[0].values.iter().zip([parts[0].values[0], parts[0].values[2]]) {
            assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_unit_of_a_magnitude_is_kept_unless_it_is_one_or_decibel() {
        let unit = |header: &str, decibel: bool| {
            let data = format!("f [Hz],m [{header}],p [deg]\n1,20,90\n").leak();
            let polar = format!(
                "frequency = 'f'\nresponses = {{ y = {{ magnitude = 'm', phase = 'p', decibel = {decibel} }} }}"
            );
            responses(&polar, data).map(|responses| responses[0].unit.as_ref().map(ToString::to_string))
        };
        assert_eq!(unit("mrad/(N m)", false), Ok(Some("mrad/(N m)".to_owned())));
        assert_eq!((unit("1", false), unit("dB", false), unit("volts", true)), (Ok(None), Ok(None), Ok(None)));
        let unknown = unit("volts", false).unwrap_err();
        assert!(unknown.contains("unknown unit `volts` of `m` in the header of"), "{unknown}");
    }

    #[test]
    fn missing_or_wrong_entries_are_reported_at_their_location() {
        let data = "f [m],re,im\n1,0,10\n-2,1,0\n";
        let wrong = |experiment: &str| responses(experiment, data).unwrap_err();
        let both = "responses = { y = { real = 're', imaginary = 'im' } }";
        assert!(wrong(both).contains("study.toml:3:1: the responses have no frequency column"), "{}", wrong(both));
        let length = wrong(&format!("frequency = 'f'\n{both}"));
        assert!(length.contains("study.toml:3:13: the frequency column `f` is in `m`"), "{length}");
        let negative = wrong(&format!("frequency = 'f'\nfrequency-unit = 'Hz'\n{both}"));
        assert!(negative.contains("sweep.csv:3:1: sample 2 of the frequency `f` is -2"), "{negative}");
        let half = responses("frequency = 'f'\nresponses = { y = { real = 're' } }", "f,re\n1,0\n2,1\n").unwrap_err();
        assert!(half.contains("a real and an imaginary part"), "{half}");
    }
}
