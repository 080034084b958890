//! Outputs predicted by the recalibrated model, one table per experiment.

use mops_outcome::diagnosis::{Diagnosis, Prediction};

use mops_content::{
    numbers::{FileNames, significant},
    write_header,
};

/// Returns NAME and content of `predictions/NAME.csv` for every experiment: the time, then a column per measured
/// output.
///
/// The rows are the samples of the first channel. A cell is empty if its channel has no sample at that time.
pub fn predictions(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    let mut names = FileNames::default();
    let of_experiments = diagnosis.predictions.chunk_by(|a, b| a.experiment == b.experiment);
    of_experiments.map(|channels| (names.unique(&channels[0].experiment), table(channels))).collect()
}

fn table(channels: &[Prediction]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = channels.iter().map(|c| format!("{}[{}]", c.signal, if c.unit.is_empty() { "1" } else { &c.unit }));
    write_header(&mut writer, std::iter::once("t[s]".to_owned()).chain(header)).expect("memory can be written to");
    let mut write = |row: Vec<String>| writer.write_record(row).expect("memory can be written to");
    // N.B.: channels from one file have bitwise equal times.
    let mut next = vec![0; channels.len()];
    for &time in &channels[0].times {
        let cells = channels.iter().zip(&mut next).map(|(channel, next)| {
            while channel.times.get(*next).is_some_and(|&t| t < time) {
                *next += 1;
            }
            let sampled = channel.times.get(*next).is_some_and(|&t| t == time);
            let value = channel.after.get(*next).filter(|value| sampled && value.is_finite());
            value.map_or_else(String::new, |value| significant(*value, 12))
        });
        write(std::iter::once(significant(time, 12)).chain(cells).collect());
    }
    String::from_utf8(writer.into_inner().expect("memory can be written to")).expect("CSV of strings is UTF-8")
}

#[cfg(test)]
mod tests {
    use super::super::made_up;
    use super::*;

    #[test]
    fn rows_are_the_samples_of_the_first_channel_and_a_gap_of_another_is_an_empty_cell() {
        let mut diagnosis = made_up::coulomb();
        let tables = predictions(&diagnosis);
        assert_eq!(tables.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["swing", "push"]);
        let rows: Vec<&str> = tables[0].1.lines().collect();
        let first = &diagnosis.predictions[0];
        assert_eq!((rows[0], rows.len()), ("t[s],phi[rad],theta[rad]", 1 + first.times.len()));
        let cells: Vec<f64> = rows[3].split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(cells[0], first.times[2]);
        assert!((cells[1] - first.after[2]).abs() < 1e-11, "{} is not {}", cells[1], first.after[2]);

        let second = &mut diagnosis.predictions[1];
        for list in [&mut second.times, &mut second.measured, &mut second.before, &mut second.after] {
            list.remove(2);
        }
        let rows: Vec<String> = predictions(&diagnosis)[0].1.lines().map(str::to_owned).collect();
        assert!(rows[3].ends_with(',') && !rows[2].ends_with(',') && !rows[4].ends_with(','), "{:?}", &rows[..5]);
    }
}
