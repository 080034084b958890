//! Families of names such as `T[1]` to `T[100]`, merged into one row of a table.

use std::ops::Range;

/// Splits names into runs whose members differ only in their index; every other name is a run by itself.
pub(super) fn runs(names: &[&str]) -> Vec<Range<usize>> {
    let base = |i: usize| names[i].split_once('[').filter(|(_, rest)| rest.ends_with(']')).map(|(base, _)| base);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for i in 0..names.len() {
        match runs.last_mut() {
            Some(run) if base(i).is_some() && base(i) == base(run.start) => run.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}

/// Returns the name of a run: `T[1..100]`, or the name of its only member.
pub(super) fn spelled(first: &str, last: &str) -> String {
    match (first.strip_suffix(']'), last.split_once('[')) {
        (Some(start), Some((_, end))) if first != last => format!("{start}..{end}"),
        _ => first.to_owned(),
    }
}

/// Merges rows of the same family, by the names in column `name`, if their other cells agree. Of more than six
/// differing rows, only the first two and the last remain.
pub(super) fn folded(rows: Vec<Vec<String>>, name: usize) -> Vec<Vec<String>> {
    let names: Vec<&str> = rows.iter().map(|row| row[name].as_str()).collect();
    let mut folded = Vec::new();
    for run in runs(&names) {
        let members = &rows[run.clone()];
        let (first, last) = (&members[0], &members[members.len() - 1]);
        let alike = |row: &Vec<String>| (0..row.len()).all(|i| i == name || row[i] == first[i]);
        if members.len() > 1 && members.iter().all(alike) {
            let mut row = first.clone();
            row[name] = spelled(&first[name], &last[name]);
            folded.push(row);
        } else if members.len() > 6 {
            let mut row = vec![String::new(); first.len()];
            row[name] = format!("and {} more", members.len() - 3);
            folded.extend([members[0].clone(), members[1].clone(), row, last.clone()]);
        } else {
            folded.extend(members.iter().cloned());
        }
    }
    folded
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<Vec<String>> {
        text.split(' ').map(|row| row.split('=').map(str::to_owned).collect()).collect()
    }

    #[test]
    fn members_that_are_alike_are_one_row_and_many_others_are_cut() {
        assert_eq!(folded(rows("a=1 T[1]=2 T[2]=2 T[3]=2 b[1]=2"), 0), rows("a=1 T[1..3]=2 b[1]=2"));
        assert_eq!(folded(rows("T[1]=1 T[2]=2"), 0), rows("T[1]=1 T[2]=2"));
        let many: Vec<Vec<String>> = (1..=100).map(|i| vec![format!("T[{i}]"), i.to_string()]).collect();
        let cut = folded(many, 0);
        let names: Vec<&str> = cut.iter().map(|row| row[0].as_str()).collect();
        assert_eq!(names, ["T[1]", "T[2]", "and 97 more", "T[100]"]);
    }
}
