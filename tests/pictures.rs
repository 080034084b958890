//! The pictures of the README are up to date: the stored digest is that of the study and of the report template.

use std::fs;
use std::path::Path;

use mops::file::digest;

/// Pictures in docs/pictures, each with its study.
const PICTURES: [(&str, &str); 2] = [("design", "pid-design"), ("diagnosis", "furuta-discrepancy")];

/// Files of the report template: layout, style, and the first part of a page.
const TEMPLATE: [&str; 5] = [
    "crates/report/src/page.rs",
    "crates/report/src/markup.rs",
    "crates/report/src/style.css",
    "crates/report/src/charts.js",
    "crates/tasks/src/verdict.rs",
];

#[test]
fn pictures_are_up_to_date_with_their_studies_and_the_report_template() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| fs::read(root.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    for (picture, study) in PICTURES {
        let study = format!("studies/{study}/study.toml");
        let shown: Vec<u8> = TEMPLATE.into_iter().chain([study.as_str()]).flat_map(read).collect();
        let path = root.join(format!("docs/pictures/{picture}.digest"));
        let digest = digest(&shown) + "\n";
        if std::env::var("PICTURES").is_ok_and(|update| update == "update") {
            fs::write(&path, &digest).unwrap();
        }
        let stored = fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(stored, digest, "{picture}.png shows an earlier report: run docs/pictures/make, and look at it");
        assert!(read(&format!("docs/pictures/{picture}.png")).starts_with(b"\x89PNG"), "{picture}");
    }
}
