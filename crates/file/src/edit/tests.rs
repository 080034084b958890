//! Edits preserve the rest of the text.

use proptest::prelude::*;
use toml::{Table, Value};

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
    let text = text.into_text();
    let read: Table = toml::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert!(read.contains_key("study"));
    text
}

#[test]
fn a_value_is_replaced_in_place_and_its_comment_stays() {
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
fn a_removed_entry_becomes_a_comment_with_the_reason() {
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
fn comments_within_braces_and_at_the_end_stay_where_they_are() {
    let text = "a = {\n  x = 1, # one\n  y = 2 # two\n}\nb = {\n  x = 1, # one\n}\n[c]\nd = 1\n# e = 2\n";
    let mut edited = TomlText::new(text);
    edited.set(&["a", "z"], "3");
    edited.set(&["b", "z"], "3");
    edited.set(&["f", "g"], "1");
    edited.set(&["f", "h"], "2");
    let expected = text.replace("y = 2 #", "y = 2, z = 3 #").replace("1, # one\n}", "1, z = 3, # one\n}");
    assert_eq!(edited.into_text(), expected + "\n[f]\ng = 1\nh = 2\n");
}

#[test]
fn an_array_of_tables_is_edited_as_a_whole_and_its_data_files_are_converted() {
    let text = "[[cases.a.inputs.u]]\nconstant = 2\n\n[study]\nname = \"s\"\n\n[[cases.a.inputs.u]] # data\n\
                file.path = \"u.csv\"\n";
    let moved = settled(text, &[], &|path| format!("../{path}")).into_text();
    assert_eq!(moved, text.replace("u.csv", "../u.csv"));
    let replaced = settled(text, &["cases.a.inputs.u.constant=3".to_owned()], &str::to_owned).into_text();
    let expected = "# replaced\n# [[cases.a.inputs.u]]\n# constant = 2\n\n[study]\nname = \"s\"\n\n\
                    # [[cases.a.inputs.u]] # data\n# file.path = \"u.csv\"\n\n[cases.a.inputs.u]\nconstant = 3\n";
    assert_eq!(replaced, expected);
}

#[test]
fn keys_and_texts_are_quoted_where_they_must_be() {
    assert_eq!([key("arm"), key("arm.torque"), key("")], ["arm", "\"arm.torque\"", "\"\""]);
    for odd in ["a\nb", "\"\"\"", "'\n\"", "\u{1b}[2J", "a\r\nfn", "\\", "\u{85}\u{7f}", "\t", "\0", "é\n"] {
        let read: Table = format!("{} = {}\nx = {{ {0} = {1} }}", key(odd), quoted(odd)).parse().unwrap();
        assert_eq!(read[odd].as_str(), Some(odd));
        assert!(!key(odd).contains('\n') && !quoted(odd).contains('\n'), "{odd:?}");
    }
    let text = TomlText::new(TEXT);
    assert_eq!(text.item(&["experiments", "swing", "file"]).and_then(Item::as_str), Some("swing.csv"));
    assert_eq!(text.keys(&["tuners"]), ["b", "bp", "d"]);
}

#[test]
fn paths_of_data_files_are_converted_wherever_they_are() {
    let text = "[cases.a]\ninputs.u = [{ constant = 2 }, { file = { path = \"u.csv\", column = \"v\" } }]  # a sum\n\
                inputs.w.file = { path = 'w.csv', column = \"file\" }\n\
                [experiments.e]\nfile = \"e.csv\"\ninputs.z = [1, 2]\n";
    let moved = settled(text, &[], &|path| format!("../{path}")).into_text();
    let expected = text.replace("u.csv", "../u.csv").replace("'w.csv'", "\"../w.csv\"").replace("e.csv", "../e.csv");
    assert_eq!(moved, expected);
}

/// Generates a document or a setting: numbers and tables under a few keys.
fn tables() -> impl Strategy<Value = Value> {
    let number = (0i64..100).prop_map(Value::Integer);
    let keys = prop::sample::select(vec!["a", "b", "c \n\"d"]);
    let table = move |inner: BoxedStrategy<Value>| prop::collection::btree_map(keys.clone(), inner, 0..3);
    let named = |table: std::collections::BTreeMap<&str, Value>| {
        Value::Table(table.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
    };
    let inner = number.prop_recursive(3, 16, 3, move |inner| table(inner.boxed()).prop_map(named).boxed());
    inner.prop_map(|value| if value.is_table() { value } else { Value::Table(Table::from_iter([("a".into(), value)])) })
}

/// Formats a table as text. `forms` selects the form of each nested table: braces, dots or a header.
fn rendered(table: &Table, [header, above]: [&[String]; 2], forms: &mut impl Iterator<Item = u8>) -> String {
    let (mut own, mut later) = (String::new(), String::new());
    for (key, value) in table {
        let path = [above, &[self::key(key)]].concat();
        match (value.as_table(), forms.next().unwrap_or(0)) {
            (Some(below), 1) if !below.is_empty() => own += &rendered(below, [header, &path], forms),
            (Some(below), 2) if above.is_empty() => {
                let header = [header, &path].concat();
                later += &format!("\n[{}]\n{}", header.join("."), rendered(below, [&header, &[]], forms));
            }
            (Some(_), _) => own += &format!("{} = {}\n", path.join("."), inline(value)),
            (None, _) => own += &format!("{} = {value} # a number\n", path.join(".")),
        }
    }
    own + &later
}

fn inline(value: &Value) -> String {
    match value.as_table() {
        Some(table) => {
            let entries: Vec<String> =
                table.iter().map(|(key, v)| format!("{} = {}", self::key(key), inline(v))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        None => value.to_string(),
    }
}

#[test]
fn a_value_written_with_dots_within_braces_is_replaced_as_a_whole() {
    for (text, path, value, expected) in [
        ("b = { a.a = 0 }", ["b", "a"], "1", "b = { a = 1 }"),
        ("b = { a.a = 0, c = 2 }", ["b", "a"], "1", "b = { c = 2, a = 1 }"),
        ("b = { c = 2, a . \"x\\\" y\".'z' = 0 }", ["b", "a"], "1", "b = { c = 2, a = 1 }"),
        ("b = { a.x = 0, a.y = 3 }", ["b", "a"], "1", "b = { a = 1 }"),
    ] {
        let mut edited = TomlText::new(text);
        edited.set(&path, value);
        let edited = edited.into_text();
        let parsed = |text: &str| text.parse::<Table>().unwrap();
        assert_eq!(parsed(&edited), parsed(expected), "{text}: {edited}");
    }
}

/// Merges a setting into a table.
fn merged(into: &mut Table, from: &Table) {
    for (key, value) in from {
        match (into.get_mut(key), value) {
            (Some(Value::Table(old)), Value::Table(new)) if !new.is_empty() => merged(old, new),
            _ => drop(into.insert(key.clone(), value.clone())),
        }
    }
}

proptest! {
    #![proptest_config(mops_tiers::property(20_000))]

    #[test]
    fn a_text_with_merged_settings_equals_the_study_as_read(
        document in tables(),
        settings in prop::collection::vec(tables(), 0..3),
        forms in prop::collection::vec(0u8..3, 12),
    ) {
        let mut expected = document.as_table().unwrap().clone();
        let text = rendered(&expected, [&[], &[]], &mut forms.into_iter().cycle().take(200));
        prop_assert_eq!(&text.parse::<Table>().unwrap(), &expected);
        let mut lines = Vec::new();
        for setting in &settings {
            for (key, value) in setting.as_table().unwrap() {
                merged(&mut expected, &Table::from_iter([(key.clone(), value.clone())]));
                lines.push(format!("{} = {}", self::key(key), inline(value)));
            }
        }
        let with = settled(&text, &lines, &str::to_owned).into_text();
        let read = with.parse::<Table>();
        prop_assert!(read.is_ok(), "{text}\n---\n{lines:?}\n---\n{with}");
        prop_assert_eq!(read.unwrap(), expected, "{}\n---\n{:?}\n---\n{}", text, lines, with);
    }
}
