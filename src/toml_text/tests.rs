//! Edits leave all else as it is.

use super::*;

const TEXT: &str = "\
# A swing.
[study]
name = \"swing\" # short

[models.rig.furuta]
tolerance = 1e-9

[tuners]
b  = { start = 2e-3, min = 5e-4 }   # inertia
bp.start = 1e-5
bp.min = 0.0

[tuners.d]
start = 1.0
values = [
  1.0,
  2.0,
]

[experiments.swing]
file = 'swing.csv'
";

fn edited(edit: impl FnOnce(&mut TomlText)) -> String {
    let mut text = TomlText::new(TEXT);
    edit(&mut text);
    let read: toml::Table = toml::from_str(&text.0).unwrap_or_else(|e| panic!("{e}\n{}", text.0));
    assert!(read.contains_key("study"));
    text.0
}

#[test]
fn a_value_is_replaced_where_it_stands_and_its_comment_stays() {
    assert_eq!(edited(|t| t.set(&["study", "name"], "\"x\"")), TEXT.replace("\"swing\" #", "\"x\" #"));
    let started = edited(|t| t.set(&["tuners", "b", "start"], "7.0"));
    assert_eq!(started, TEXT.replace("start = 2e-3", "start = 7.0"));
}

#[test]
fn a_new_value_goes_where_its_table_is_whatever_its_form() {
    let cases: [(&[&str], &str, &str); 6] = [
        (&["tuners", "b", "max"], "min = 5e-4 }", "min = 5e-4, max = 1 }"),
        (&["tuners", "bp", "max"], "bp.min = 0.0\n", "bp.min = 0.0\nbp.max = 1\n"),
        (&["tuners", "d", "min"], "  2.0,\n]\n", "  2.0,\n]\nmin = 1\n"),
        (&["tuners", "arm.c"], "bp.min = 0.0\n", "bp.min = 0.0\n\"arm.c\" = 1\n"),
        (&["models", "rig", "effects", "arm"], "1e-9\n", "1e-9\n\n[models.rig.effects]\narm = 1\n"),
        (&["criteria", "phi"], "'swing.csv'\n", "'swing.csv'\n\n[criteria]\nphi = 1\n"),
    ];
    for (path, from, to) in cases {
        assert_eq!(edited(|t| t.set(path, "1")), TEXT.replace(from, to), "{path:?}");
    }
    let twice = edited(|t| {
        t.set(&["models", "rig", "effects", "arm"], "{}");
        t.set(&["models", "rig", "effects", "pendulum"], "{}");
        t.set(&["models", "rig", "effects", "arm", "at"], "1");
    });
    let dotted = edited(|t| {
        t.set(&["tuners", "b", "x", "y"], "1");
        t.set(&["tuners", "b", "x", "z"], "2");
    });
    assert!(dotted.contains("min = 5e-4, x.y = 1, x.z = 2 }"), "{dotted}");
    assert!(twice.contains("[models.rig.effects]\narm = { at = 1 }\npendulum = {}\n"), "{twice}");
}

#[test]
fn what_is_removed_becomes_a_comment_that_says_why() {
    assert_eq!(edited(|t| t.remove(&["tuners", "b"], "not needed")), TEXT.replace("b  = {", "# not needed\n# b  = {"));
    assert_eq!(
        edited(|t| t.remove(&["tuners", "bp"], "gone")),
        TEXT.replace("bp.start", "# gone\n# bp.start").replace("bp.min", "# bp.min")
    );
    let section = edited(|t| t.remove(&["tuners", "d"], "gone"));
    assert!(
        section.contains("# gone\n# [tuners.d]\n# start = 1.0\n# values = [\n#   1.0,\n#   2.0,\n# ]\n"),
        "{section}"
    );
    assert_eq!(edited(|t| t.remove(&["tuners", "b", "min"], "")), TEXT.replace(", min = 5e-4", ""));
    assert_eq!(edited(|t| t.remove(&["tuners", "b", "start"], "")), TEXT.replace("start = 2e-3, ", ""));
}

#[test]
fn keys_and_texts_are_quoted_where_they_must_be() {
    assert_eq!([key("arm"), key("arm.torque"), key("")], ["arm", "\"arm.torque\"", "\"\""]);
    let text = TomlText::new(TEXT);
    assert_eq!(text.words(&["experiments", "swing", "file"]).as_deref(), Some("swing.csv"));
    assert_eq!(text.keys(&["tuners"]), ["b", "bp", "d"]);
}
