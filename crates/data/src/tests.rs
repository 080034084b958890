//! Tests of the readers with files from small independent writers, and with damaged files.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use proptest::prelude::*;
use proptest::sample::Index;

use super::*;

fn read(bytes: impl Into<Vec<u8>>) -> DataFile {
    DataFile::parse("data", bytes.into()).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the error as the user sees it, and the marked text.
fn error(bytes: impl Into<Vec<u8>>) -> (String, String) {
    let error = DataFile::parse("data", bytes.into()).expect_err("the file is wrong");
    let (source, span) = error.place.clone().expect("an error in a file has a place");
    (error.to_string(), source.text[span].to_owned())
}

fn values<'a>(file: &'a DataFile, column: &str) -> &'a [f64] {
    file.column(column).unwrap_or_else(|error| panic!("{error}")).values
}

/// Asserts equality bit by bit, since NaN is not equal to itself.
fn assert_same(found: &[f64], expected: &[f64]) {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(found), bits(expected), "{found:?} is not {expected:?}");
}

mod csv {
    use super::*;

    #[test]
    fn header_gives_names_and_units() {
        let file = read("t[s], u [N*m],\"th, m[rad]\",plain\n0,1,2,3\n0.5,-1e-3,+2,.5\n");
        assert_eq!(file.format.to_string(), "CSV");
        assert_eq!(file.column_names(), ["t", "u", "th, m", "plain"]);
        let units: Vec<_> = file.column_names().iter().map(|name| file.column(name).unwrap().unit).collect();
        assert_eq!(units, [Some("s"), Some("N*m"), Some("rad"), None]);
        assert_same(values(&file, "u"), &[1.0, -1e-3]);
        assert_same(values(&file, "plain"), &[3.0, 0.5]);
    }

    #[test]
    fn blanks_separate_cells_and_units_belong_to_names() {
        for text in
            ["t [s]  u (V)   y\n 0.0   1.5  -2\n 0.1  2,5   3e-1 \n", "  t[s] u[V] y\n0.0 1.5 -2\n\n0.1 2.5 0.3"]
        {
            let text = if text.contains(',') {
                text.replace("1.5", "1,5").replace("0.", "0,").replace("3e-1", "0,3")
            } else {
                text.into()
            };
            let file = read(text.as_str());
            assert_eq!(file.column_names(), ["t", "u", "y"]);
            assert_eq!(file.column("u").unwrap().unit, Some("V"));
            assert_same(values(&file, "u"), &[1.5, 2.5]);
            assert_same(values(&file, "y"), &[-2.0, 0.3]);
            let cell = file.span_of("y", 1);
            assert_eq!(&file.source.text[cell], if text.contains(',') { "0,3" } else { "0.3" });
        }
        // Without a header.
        assert_same(values(&read("0 1\n0.1 2\n"), "2"), &[1.0, 2.0]);
        // A header of several words over one column.
        assert_eq!(read("motor voltage\n1\n2\n").column_names(), ["motor voltage"]);
    }

    #[test]
    fn time_stamps_count_from_the_first_one() {
        let file = read("when,y\n2024-02-29T23:59:59.5Z,1\n,2\n2024-03-01T00:00:01Z,3\n");
        let column = file.column("when").unwrap();
        let origin = Origin { nanoseconds: 1_709_251_199_500_000_000, reference: Reference::Universal };
        assert_eq!((column.unit, column.origin), (Some("s"), Some(origin)));
        assert_same(column.values, &[0.0, f64::NAN, 1.5]);
        assert_eq!(file.time_column().as_deref(), Some("when"));
        // One cell that is no time stamp makes the column a text.
        assert_eq!(read("when,y\n2024-02-29,1\nlater,2\n").column_names(), ["y"]);
    }

    #[test]
    fn parentheses_with_a_unit_are_brackets_and_a_column_answers_to_its_label() {
        let file = read("t (ms),T (\u{b0}C),speed (deg/s),trial (2),motor (left)\n0,1,2,3,4\n");
        assert_eq!(file.column_names(), ["t", "T", "speed", "trial (2)", "motor (left)"]);
        let units: Vec<_> = file.column_names().iter().map(|name| file.column(name).unwrap().unit).collect();
        assert_eq!(units, [Some("ms"), Some("\u{b0}C"), Some("deg/s"), None, None]);
        assert_eq!(file.time_column().as_deref(), Some("t"));
        for label in ["t", "t (ms)", "t [ms]", " t(ms)"] {
            assert_eq!(file.column(label).unwrap().unit, Some("ms"), "{label}");
        }
        assert!(file.column("t (s)").is_err());
        for header in ["motor (V),motor (A)", "motor[V],motor[A]"] {
            let motor = read(format!("{header}\n0,1\n").as_str());
            assert_eq!(motor.column_names(), ["motor (V)", "motor (A)"]);
            for label in ["motor (A)", "motor [A]"] {
                assert_eq!(motor.column(label).unwrap().unit, Some("A"), "{header}");
            }
        }
    }

    #[test]
    fn separator_is_found_in_the_header() {
        for text in ["a,b\n1.5,2\n", "a;b\n1.5;2\n", "a;b\n1,5;2\n", "a\tb\n1.5\t2\n", "a[N,m];b\n1,5;2\n"] {
            let file = read(text);
            assert_same(values(&file, "a"), &[1.5]);
            assert_same(values(&file, "b"), &[2.0]);
        }
    }

    #[test]
    fn byte_order_mark_comments_blank_lines_and_crlf_are_tolerated() {
        let file = read("\u{feff}# rig 2\r\n\r\n# t is time\r\nt,y\r\n0,1\r\n\r\n1,2\r\n\r\n");
        assert_same(values(&file, "y"), &[1.0, 2.0]);
        assert_eq!(&file.source.text[file.span_of("y", 1)], "2");
    }

    #[test]
    fn columns_without_a_header_or_a_name_are_called_by_their_number() {
        let file = read("0,1.5,\n1,2.5,3\n");
        assert_eq!(file.column_names(), ["1", "2", "3"]);
        assert_same(values(&file, "2"), &[1.5, 2.5]);
        assert_eq!(read(",y,[m]\n0,1,2\n").column_names(), ["1", "y", "3"]);
    }

    #[test]
    fn gaps_are_nan() {
        let gap = f64::NAN;
        let file = read("t,y\n0,\n1,NaN\n2,nan\n3,NA\n4, \n5,7\n");
        assert_same(values(&file, "y"), &[gap, gap, gap, gap, gap, 7.0]);
        assert_same(values(&read("y\n1\n\n\n4\r\n\r\n6\n\n"), "y"), &[1.0, gap, gap, 4.0, gap, 6.0]);
        assert_same(values(&read("1\n\n3\n"), "1"), &[1.0, gap, 3.0]);
    }

    #[test]
    fn column_of_text_is_skipped_with_a_reason() {
        let file = read("t,how\n0,fast\n1,NA\n");
        assert_eq!(file.skipped, ["how: text (`fast`)"]);
        assert_eq!(file.column_names(), ["t"]);
        let asked = file.column("how").unwrap_err().to_string();
        assert_eq!(asked, "`how` of data is not a column of numbers: text (`fast`); columns of numbers: t");
    }

    #[test]
    fn span_of_a_cell_is_its_bytes_in_the_text() {
        let file = read("t,\"a,b\",why,y\n0,\"1\",\"x,\"\"y\",2\n\n3, 4 ,\"two\nlines\",5\n");
        let cells: Vec<_> = [("t", 0), ("a,b", 0), ("y", 0), ("t", 1), ("a,b", 1), ("y", 1)]
            .map(|(name, row)| &file.source.text[file.span_of(name, row)])
            .to_vec();
        assert_eq!(cells, ["0", "\"1\"", "2", "3", " 4 ", "5"]);
        assert_eq!((file.span_of("y", 2), file.span_of("why", 0)), (0..0, 0..0));
    }

    #[test]
    fn unknown_column_gets_the_nearest_name_or_all() {
        let file = read("time,omega\n0,1\n");
        let error = |name| file.column(name).unwrap_err().to_string();
        assert_eq!(error("omgea"), "no column `omgea` in data; did you mean `omega`?");
        assert_eq!(error("q"), "no column `q` in data; known: time, omega");
    }

    #[test]
    fn every_mistake_is_reported_with_its_place_and_the_way_out() {
        let gap = "write a number such as 1.5e-3; a gap is an empty cell, NaN or NA";
        let cells = "write the same number of cells in every row, an empty one for a gap";
        let comma = "write the same number of cells in every row; decimal commas need `;` as separator";
        let marks = "decimal points and decimal commas are mixed; use one decimal mark, and no thousands separators";
        let (open, quote) = ("quotation mark", "remove the quotation mark, or close it in the same line");
        let cases = [
            ("", "data: the data file is empty; write a header such as `t[s],u[N*m]` and rows of numbers below it", ""),
            ("t,y\n", "data:1:1: the header has no rows below it; add a row of numbers for each sample", "t,y"),
            ("t,y\n0,1\n1,x2\n", &format!("data:3:3: `x2` in column `y` is not a number; {gap}"), "x2"),
            ("t,y\n0,inf\n1,2\n", &format!("data:2:3: `inf` in column `y` is not finite; {gap}"), "inf"),
            ("t,y\n0,1e999\n", &format!("data:2:3: `1e999` in column `y` is not finite; {gap}"), "1e999"),
            ("t;y\n0;1.234,5\n1;2", &format!("data:2:3: {marks}"), "1.234,5"),
            ("t;y\n0;1.5\n1;1,234\n", &format!("data:3:3: {marks}"), "1,234"),
            ("t\ty\n0,1\t2\n0.2\t3\n", &format!("data:3:1: {marks}"), "0.2"),
            ("t,y,note\n0,1,\"a\n1,2,b\n2,3,c\n", &format!("data:2:5: unclosed {open}; {quote}"), "\"a"),
            ("t,y,\"note\n0,1,a\n1,2,b\n", &format!("data:1:5: unclosed {open}; {quote}"), "\"note"),
            ("t,n,y\n0,\"a,1\n1,b\",2\n2,c,3\n", &format!("data:2:3: {open} closed in another row; {quote}"), "\"a,1"),
            ("t,y\n0,1\n1\n", &format!("data:3:1: the row has 1 cell, the first line has 2; {cells}"), "1"),
            ("t,y\n0,1,5\n", &format!("data:2:1: the row has 3 cells, the first line has 2; {comma}"), "0,1,5"),
            (
                "t[s],t[s]\n0,1\n",
                "data:1:6: columns 1 and 2 have the same name `t`; rename one of them in the header",
                "t[s]",
            ),
            (
                "t y\n0 1 2\n",
                "data:1:1: no column of the file contains numbers; separate the cells by commas, semicolons, tabs or blanks",
                "t y",
            ),
        ];
        for (text, message, marked) in cases {
            assert_eq!(error(text), (message.to_owned(), marked.to_owned()));
        }
    }

    #[test]
    fn a_separator_at_the_end_of_a_line_starts_no_column() {
        for text in ["t,y,\n0,1,\n1,2,\n", "t,y\n0,1,\n1,2,\n", "t;y;\n0;1\n", "t,y\n0,1,\n1,2\n"] {
            let text = text.replace("t;y;\n0;1\n", "t;y;\n0;1;\n");
            assert_eq!(read(text.as_str()).column_names(), ["t", "y"], "{text}");
        }
        assert_eq!(read("t,y,\n0,1,5\n").column_names(), ["t", "y", "3"]);
    }

    #[test]
    fn decimal_commas_are_read_between_semicolons_and_between_tabs() {
        for text in ["t;y\n0,5;-1,25e3\n", "t\ty\n0,5\t-1,25e3\n"] {
            assert_eq!(read(text).column("y").unwrap().values, [-1250.0], "{text}");
        }
    }

    #[test]
    fn marks_of_thousands_are_refused_and_decimal_numbers_of_three_digits_are_not() {
        let way_out = "write thousands without a mark, or decimal numbers with a fixed number of digits";
        let expected =
            |place: &str, cell: &str| format!("data:{place}: `{cell}` is a thousand or a decimal number; {way_out}");
        for (text, place, cell) in [
            ("t;n\n0;993\n1;999\n2;1.024\n3;1.043\n", "4:3", "1.024"),
            ("t\tn\n0\t993\n1\t999\n2\t-1,024\n3\t1,043\n", "4:3", "-1,024"),
            ("t,n\n0,993\n1,999\n2,1.024\n3,1.043\n", "4:3", "1.024"),
        ] {
            assert_eq!(error(text), (expected(place, cell), cell.to_owned()), "{text}");
        }
        for cells in
            ["1 1.125 2.250 3", "1 0.125 0.375 2", "1 1.125 1.25 2.375 3", "1.000 1.125 2.375 999.125", "1 2 1.125 3"]
        {
            let rows: Vec<String> = cells.split(' ').enumerate().map(|(t, y)| format!("{t};{y}")).collect();
            let file = DataFile::parse("data", format!("t;y\n{}\n", rows.join("\n")).into_bytes());
            assert_eq!(file.is_ok(), cells != "1 1.125 2.250 3", "{cells}");
        }
    }

    #[test]
    fn a_first_line_of_numbers_and_time_stamps_is_a_row() {
        let file = read("2024-05-03T11:59:50,1,20.5\n2024-05-03T11:59:51,1,20.6\n");
        assert_same(values(&file, "1"), &[0.0, 1.0]);
        assert_same(values(&file, "3"), &[20.5, 20.6]);
        assert_eq!(file.time_column().as_deref(), Some("1"));
    }

    #[test]
    fn the_time_is_the_column_of_its_name_not_of_its_first_letter() {
        for (header, time) in [
            ("t,T", Some("t")),
            ("T,t", Some("t")),
            ("T[degC],Time", Some("Time")),
            ("T[degC],y", None),
            ("T,y", None),
            ("T[ms],y", Some("T")),
            ("torque,y", None),
            ("TIME,t", Some("TIME")),
        ] {
            assert_eq!(read(format!("{header}\n0,1\n").as_str()).time_column().as_deref(), time, "{header}");
        }
    }

    #[test]
    fn headers_as_people_write_them_have_their_time_and_their_units() {
        for (header, time, units) in [
            ("time_s,P_heater_W,T_oven_degC", "time_s", [Some("s"), Some("W"), Some("degC")]),
            ("Zeit / s;Heizleistung / W;Ofentemperatur / \u{b0}C", "Zeit", [Some("s"), Some("W"), Some("\u{b0}C")]),
            ("Time (s),speed (rpm),u_V", "Time", [Some("s"), Some("rpm"), Some("V")]),
            ("Timestamp;Druck in bar;Kommentar", "Timestamp", [None, Some("bar"), None]),
            ("x_m;elapsed [min];i_d", "elapsed", [None, Some("min"), None]),
            ("t_s,x_m,x_ref", "t_s", [Some("s"), None, None]),
            ("t\tQ / (l/min)\tp / (kg/(m s^2))", "t", [None, Some("l/min"), Some("kg/(m s^2)")]),
        ] {
            let separator = if header.contains(';') {
                ";"
            } else if header.contains('\t') {
                "\t"
            } else {
                ","
            };
            let rows = ["0", "1"].map(|t| [t, t, t].join(separator)).join("\n");
            let file = read(format!("{header}\n{rows}\n").as_str());
            let names = file.column_names();
            assert_eq!(file.time_column().as_deref(), Some(time), "{header}");
            let found: Vec<_> = names.iter().map(|name| file.column(name).unwrap().unit).collect();
            assert_eq!(found, units, "{header}");
            // Every column answers to its whole label, too.
            for label in header.split(separator) {
                assert!(file.column(label).is_ok(), "{label}");
            }
        }
    }

    #[test]
    fn units_in_a_line_below_the_names_are_read() {
        for text in ["t;u;y\ns;V;-\n0;1;2\n1;2;3\n", "t,u,y\n[s],(V),\n0,1,2\n1,2,3\n"] {
            let file = read(text);
            assert_eq!((file.column("t").unwrap().unit, file.column("u").unwrap().unit), (Some("s"), Some("V")));
            assert_same(values(&file, "y"), &[2.0, 3.0]);
        }
        assert!(error("t,u\ns,Volt\n0,1\n").0.contains("is not a number"));
    }

    #[test]
    fn lines_of_an_instrument_before_the_header_are_skipped_and_counted() {
        for text in [
            "Logger 7;;\nStart;2024-05-01;\nInterval;0.5;\n\nt [s];u [V];y\n0;1;2\n1;2;3\n",
            "Logger 7;;\nStart;2024-05-01;\n;;\nt [s];u [V];y\n0;1;2\n1;2;3\n",
            "Measurement of the rig\nby hand, twice\nat night\nt [s],u [V],y\n0,1,2\n1,2,3\n",
            "sep=;\nmade by a spreadsheet\n2024\nt;u;y\ns;V;-\n0,5;1;2\n1,5;2;3\n",
        ] {
            let file = read(text);
            assert_eq!(file.column_names(), ["t", "u", "y"], "{text}");
            assert_eq!(file.column("u").unwrap().unit, Some("V"));
            assert_same(values(&file, "y"), &[2.0, 3.0]);
            assert!(file.remarks()[0].starts_with("3 lines before the header skipped"), "{:?}", file.remarks());
            let cell = file.span_of("y", 1);
            assert_eq!(&file.source.text[cell], "3");
        }
        assert!(read("t,y\n0,1\n").remarks().is_empty());
    }

    #[test]
    fn rows_of_numbers_are_never_taken_for_lines_before_the_header() {
        for text in ["t,y\n0,1\n1,2\n\nt2,y2\n0,1\n1,2\n", "1,2,3\n\nt,y\n0,1\n", "t,y\nERROR,none\n0,1\n1,2\n"] {
            assert!(DataFile::parse("data", text.into()).is_err(), "{text}");
        }
    }

    #[test]
    fn a_date_and_a_time_of_day_in_two_columns_are_one_clock() {
        let file = read("Datum;Uhrzeit;T\n31.12.2023;23:59:59;1\n01.01.2024;00:00:01;2\n");
        assert_eq!(file.time_column().as_deref(), Some("Uhrzeit"));
        assert_same(values(&file, "Uhrzeit"), &[0.0, 2.0]);
        assert_eq!(file.skipped, ["Datum: joined with `Uhrzeit`"]);
        // As a logger writes it: lines of its own, points in dates and commas in numbers.
        let file = read(
            "Messgerät: LG-40\nPrüfer: Müller, Ofen 3\nDatum;Uhrzeit;P / W;T\n12.03.2026;23:59:50;0,0;21,95\n13.03.2026;00:00:00;0,5;22,10\n",
        );
        assert_eq!(file.skipped[0], "Datum: joined with `Uhrzeit`");
        assert_eq!(file.column("Uhrzeit").unwrap().origin.unwrap().reference, Reference::Local);
    }

    #[test]
    fn times_of_day_without_their_dates_are_no_column() {
        let refused = |header: &str, rows: [&str; 3], fact: &str| {
            let file = read(format!("{header}\n{}\n", rows.join("\n")).as_str());
            assert_eq!(file.time_column(), None, "{header} {rows:?}: {:?}", file.skipped);
            let why = file.without_time("").message;
            assert!(why.contains(fact), "{why}");
            let time = header.split([',', ';']).nth(1).unwrap();
            assert!(file.column(time).is_err(), "{time}");
        };
        for (name, cells, fact) in [
            ("Datum", ["13.13.24", "14.13.24", "15.13.24"], "in `Datum`, are not read: text (`13.13.24`)"),
            ("when", ["30.02.2024", "01.03.2024", "02.03.2024"], "in `when`, are not read: text (`30.02.2024`)"),
            ("Date", ["05/01/2024", "05/02/2024", "05/03/2024"], "may be day/month or month/day"),
            ("Date", ["05-06-24", "05-06-24", "05-06-24"], "write them as year-month-day"),
            ("day", ["Mon", "Tue", "Wed"], "write them as year-month-day, or delete the column"),
            ("x", ["Mon 13.5.", "Tue 14.5.", "Wed 15.5."], "in `x`"),
            ("x", ["13.5.", "14.5.", "15.5."], "in `x`"),
            ("Tag", ["1", "2", "3"], "in `Tag`, are not read: numbers"),
            ("Messdatum", ["45000", "45001", "45002"], "numbers"),
            ("Date", ["240513", "240514", "240515"], "numbers"),
            ("Date", ["2024-05-13", "2024-05-14", "??"], "text (`??`)"),
        ] {
            let rows = [0, 1, 2].map(|k| format!("{};0{k}:00;{k}", cells[k]));
            refused(&format!("{name};Uhrzeit;T"), [&rows[0], &rows[1], &rows[2]], fact);
        }
        // Dates without times that are not read.
        refused("Uhrzeit;Datum;T", ["8h00;13.05.2024;1", "9h00;14.05.2024;2", "10h00;15.05.2024;3"], "text (`8h00`)");
        let two = "Start,Uhrzeit,End,T\n2024-05-13,08:00,2024-06-13,1\n2024-05-14,09:00,2024-06-14,2\n";
        assert!(read(two).without_time("").message.contains("several columns (`Start`, `End`)"));
    }

    #[test]
    fn dates_in_any_readable_form_are_joined_with_all_times_of_day() {
        for dates in [
            ["13.05.24", "14.05.24"],
            ["13-May-2024", "14-May-2024"],
            ["13. Mai 2024", "14. Mai 2024"],
            ["13-05-24", "14-05-24"],
            ["5/13/24", "5/14/24"],
            ["20240513", "20240514"],
            ["2024-05-13", "2024-05-14"],
            ["2024-05-13 00:00:00", "2024-05-14 00:00:00"],
        ] {
            let [a, b] = dates;
            let file = read(format!("Datum;Uhrzeit;Ende;T\n{a};00:00;00:30;1\n{b};01:00;01:30;2\n").as_str());
            assert_same(values(&file, "Uhrzeit"), &[0.0, 90_000.0]);
            assert_same(values(&file, "Ende"), &[0.0, 90_000.0]);
            assert_eq!(file.skipped, ["Datum: joined with `Uhrzeit`, `Ende`"]);
            assert_eq!(file.column("Ende").unwrap().origin.unwrap().nanoseconds, 1_715_560_200_000_000_000);
        }
        // Another column of dates, and texts that are no dates.
        let file =
            read("Kalibriert,Date,Time,rig,T\n2023-01-01,2024-05-13,23:00,1.2.3,1\n2023-01-01,2024-05-14,00:00,x,2\n");
        assert_same(values(&file, "Time"), &[0.0, 3600.0]);
        let file = read("rig,day,Time,T\nr-2024-1,7,23:00,1\nfast,7,23:30,2\n");
        assert_same(values(&file, "Time"), &[0.0, 1800.0]);
    }

    #[test]
    fn a_header_gives_the_form_of_times() {
        for header in ["Zeit [mm:ss]", "Zeit (min:sec)", "Zeit / mm:ss", "Zeit in m:s", "Zeit;T\nmm:ss"] {
            let header = if header.contains(';') { format!("{header};K") } else { format!("{header};T") };
            let file = read(format!("{header}\n59:50;1\n75:00,5;2\n").as_str());
            let column = file.column("Zeit").unwrap();
            assert_eq!((column.unit, column.origin), (Some("s"), None), "{header}");
            assert_same(column.values, &[3590.0, 4500.5]);
            assert_eq!(file.time_column().as_deref(), Some("Zeit"));
        }
        for header in ["time [ms]", "time_s", "time (s)", "time [hh:mm:ss]", "time [mm:ss:ff]"] {
            let file = read(format!("{header},T\n0:00,1\n0:10,2\n").as_str());
            let why = file.without_time("").message;
            assert!(file.time_column().is_none() && why.contains("`0:00` contradicts"), "{header}: {why}");
        }
    }

    #[test]
    fn stamps_in_digits_are_stamps_under_the_name_of_a_time() {
        let file = read("time,T\n20240513235959,1\n20240514000001,2\n");
        assert_same(values(&file, "time"), &[0.0, 2.0]);
        assert_eq!(file.column("time").unwrap().origin.unwrap().reference, Reference::Local);
        assert_same(values(&read("timestamp,T\n202405132359,1\n202405140001,2\n"), "timestamp"), &[0.0, 120e9 * 1e-9]);
        assert_same(values(&read("Date,T\n20240513,1\n20240514,2\n"), "Date"), &[0.0, 86_400.0]);
        for text in ["count,T\n20240513235959,1\n", "time [us],T\n20240513235959,1\n", "time,T\n20241313235959,1\n"] {
            let name = text.split([',', ' ']).next().unwrap();
            assert!(values(&read(text), name)[0] > 2e13, "{text}");
        }
    }

    #[test]
    fn time_stamps_that_have_no_common_clock_are_no_column() {
        let file = read("time,y\n05/01/2024 11:50:00 AM,1\n05/01/2024 11:55:00 AM,2\n");
        assert_eq!((file.column_names(), file.time_column()), (vec!["y".to_owned()], None));
        let why = file.without_time("").message;
        assert!(why.starts_with("`time` of the file") && why.contains("day/month or month/day"), "{why}");
        let file = read("time,y\n2024-06-01T00:00:00Z,1\n2024-06-01T00:00:01,2\n");
        assert!(file.without_time("").message.contains("with and without a zone"));
        assert_same(
            values(&read("time,y\n05/31/2024 11:59:59 AM,1\n06/01/2024 12:00:01 PM,2\n"), "time"),
            &[0.0, 86_402.0],
        );
    }

    #[test]
    fn a_clock_that_is_set_back_is_not_called_disorder() {
        let way_out = |text: &str, unit: f64| {
            let file = read(text);
            let time = file.time_column().unwrap();
            let times: Vec<f64> = values(&file, &time).iter().map(|t| t * unit).collect();
            file.increases(&time, &times, 0).unwrap_err().to_string()
        };
        let midnight = way_out("time,y\n23:59:50,1\n23:59:55,2\n00:00:00,3\n", 1.0);
        assert!(midnight.contains("midnight") && !midnight.contains("delete"), "{midnight}");
        let autumn = way_out("time,T\n2024-10-27 02:30:00,25\n2024-10-27 02:00:00,26\n", 1.0);
        assert!(autumn.contains("daylight saving time") && !autumn.contains("delete"), "{autumn}");
        for disorder in ["t,y\n0,1\n2,2\n1,3\n", "time,y\n2024-10-27T02:30:00Z,1\n2024-10-27T02:00:00Z,2\n"] {
            assert!(way_out(disorder, 1.0).contains("sort the rows"), "{disorder}");
        }
    }

    #[test]
    fn latin_1_and_utf_16_are_read_and_reported() {
        let text = "Zeit / s;T / \u{b0}C;Preis / \u{20ac}\n0,0;20,5;1\n1,0;21,5;2\n";
        let letter = |c: char| if c == '\u{20ac}' { 0x80 } else { u8::try_from(u32::from(c)).unwrap() };
        let latin: Vec<u8> = text.chars().map(letter).collect();
        let units = || text.encode_utf16();
        let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
        let marked = [b"\xff\xfe", &little[..]].concat();
        for (bytes, encoding) in [
            (latin, Encoding::Windows1252),
            (little, Encoding::Utf16),
            (big, Encoding::Utf16),
            (marked, Encoding::Utf16),
        ] {
            let file = read(bytes);
            assert_eq!(file.encoding, encoding);
            assert_eq!(file.column_names(), ["Zeit", "T", "Preis / \u{20ac}"]);
            assert_eq!(file.column("T").unwrap().unit, Some("\u{b0}C"));
            assert_same(values(&file, "T"), &[20.5, 21.5]);
            assert_eq!(file.remarks(), [format!("read as {encoding}")]);
        }
    }

    #[test]
    fn text_that_promises_utf_8_is_not_read_as_another_encoding() {
        let (message, marked) = error(b"\xef\xbb\xbft,\xef\xbf\xbd,w[\xb0]\n0,1,2\n");
        assert_eq!(
            (message.as_str(), marked.as_str()),
            ("data:1:7: the file is not UTF-8; save it as UTF-8", "\u{fffd}")
        );
        // Half a character at the end.
        let (message, _) = error(b"\xff\xfet\0,\0y\0\n\0\x30");
        assert!(message.contains("neither CSV nor MATLAB") || message.contains("UTF-16"), "{message}");
    }
}

mod files {
    use super::*;

    #[test]
    fn file_is_read_whatever_its_extension() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        std::fs::write(&path, level4(false, "time", 0, 2, 1, &le(&[0.0, 1.0]))).unwrap();
        let file = DataFile::read(&path).unwrap();
        assert_eq!((file.format, file.source.name.as_str()), (Format::Mat4, path.to_str().unwrap()));
    }

    #[test]
    fn missing_file_is_reported_with_its_path() {
        let error = DataFile::read(Path::new("no/such/file.csv")).unwrap_err().to_string();
        assert_eq!(error, "no/such/file.csv: the file does not exist; check the path");
    }

    #[test]
    fn level_7_3_is_refused_with_the_way_out() {
        let mut file = vec![0; 512];
        file[..19].copy_from_slice(b"MATLAB 7.3 MAT-file");
        file[124..128].copy_from_slice(b"\x00\x02IM");
        file.extend(b"\x89HDF\r\n\x1a\n");
        let message = "data: MATLAB level 7.3 (HDF5) is not supported; save it in MATLAB with `save -v7`";
        assert_eq!(error(&file[512..]).0, message);
        assert_eq!(error(file).0, message);
    }

    #[test]
    fn other_binary_file_is_refused_with_the_way_out() {
        let message =
            "data: the file is neither CSV nor MATLAB level 4 or 5; save it as CSV, or in MATLAB with `save -v7`";
        assert_eq!(error(b"PK\x03\x04\x14\0\x06\0\x08\0\0\0!\0").0, message);
        assert_eq!(error([0; 10]).0, message);
        assert_eq!(error(b"\x8a\x01\xff\x1b[31m").0, message);
    }

    #[test]
    fn text_that_is_called_as_a_matlab_file_is_read_if_it_can_be() {
        assert_eq!(DataFile::parse("run.mat", b"t,y\n0,1\n".to_vec()).unwrap().format, Format::Csv);
        let error = DataFile::parse("run.mat", b"404: not found".to_vec()).unwrap_err().to_string();
        let way_out = "copy it again, or save it again with `save -v7`";
        assert_eq!(error, format!("run.mat: the file is not in MATLAB format, despite its extension; {way_out}"));
    }
}

fn le(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn be(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

fn word(big_endian: bool, word: u32) -> [u8; 4] {
    if big_endian { word.to_be_bytes() } else { word.to_le_bytes() }
}

/// Returns a matrix of level 4; `code` is 10 P + T.
fn level4(big_endian: bool, name: &str, code: u32, rows: u32, columns: u32, numbers: &[u8]) -> Vec<u8> {
    let code = code + if big_endian { 1000 } else { 0 };
    let header = [code, rows, columns, 0, name.len() as u32 + 1].map(|value| word(big_endian, value));
    [header.concat().as_slice(), name.as_bytes(), &[0], numbers].concat()
}

mod mat4 {
    use super::*;

    #[test]
    fn both_byte_orders_give_the_same_columns() {
        let little = [
            level4(false, "t", 0, 3, 1, &le(&[0.0, 0.5, 1.0])),
            level4(false, "Data", 0, 2, 2, &le(&[1.0, 2.0, 3.0, f64::NAN])),
        ];
        let big = [
            level4(true, "t", 0, 3, 1, &be(&[0.0, 0.5, 1.0])),
            level4(true, "Data", 0, 2, 2, &be(&[1.0, 2.0, 3.0, f64::NAN])),
        ];
        for file in [little, big] {
            let file = read(file.concat());
            assert_eq!(file.format.to_string(), "MATLAB level 4");
            assert_eq!(file.column_names(), ["t", "Data:1", "Data:2"]);
            assert_same(values(&file, "t"), &[0.0, 0.5, 1.0]);
            assert_same(values(&file, "Data:2"), &[3.0, f64::NAN]);
            assert_eq!(file.span_of("t", 0), 0..0);
        }
    }

    #[test]
    fn every_kind_of_number_is_read() {
        let file = [
            level4(false, "single", 10, 1, 1, &(-1.5_f32).to_le_bytes()),
            level4(false, "int32", 20, 1, 1, &(-70_000_i32).to_le_bytes()),
            level4(true, "int16", 30, 1, 1, &(-300_i16).to_be_bytes()),
            level4(true, "uint16", 40, 1, 1, &60_000_u16.to_be_bytes()),
            level4(false, "uint8", 50, 1, 1, &[200]),
        ];
        let file = read(file.concat());
        let found: Vec<f64> = file.variables.iter().map(|variable| variable.values[0]).collect();
        assert_same(&found, &[-1.5, -70_000.0, -300.0, 60_000.0, 200.0]);
    }

    #[test]
    fn what_is_not_a_full_real_matrix_is_skipped_with_its_reason() {
        let mut complex = level4(false, "z", 0, 1, 1, &le(&[1.0, 2.0]));
        complex[12] = 1;
        let sparse = level4(false, "s", 2, 2, 3, &le(&[1.0; 6]));
        let file = [level4(false, "note", 51, 1, 2, b"hi"), complex, sparse, level4(false, "none", 0, 0, 9, &[])];
        let file = read([file.concat(), level4(false, "y", 0, 1, 1, &le(&[7.0]))].concat());
        assert_eq!(file.skipped, ["note: text", "z: complex numbers", "s: a sparse matrix", "none: empty"]);
        assert_eq!(file.column_names(), ["y"]);
    }

    #[test]
    fn damaged_file_is_refused() {
        let cut_off = |k| {
            format!(
                "data: the file ends inside variable {k}: it is cut off or damaged; copy it again, or save it again"
            )
        };
        let good = level4(false, "y", 0, 2, 1, &le(&[7.0, 8.0]));
        assert_eq!(error(&good[..good.len() - 1]).0, cut_off(1));
        assert_eq!(error([&good[..], &good[..15]].concat()).0, cut_off(2));
        let largest = i32::MAX as u32;
        assert_eq!(error(level4(false, "y", 0, largest, largest, &[])).0, cut_off(1));
        let (no_header, _) = error([&good[..], &[255; 20]].concat());
        assert!(
            no_header.starts_with("data: the file is damaged: variable 2 has no MATLAB level 4 header"),
            "{no_header}"
        );
    }

    #[test]
    fn wide_matrix_is_turned() {
        let file = read(level4(false, "Y", 0, 2, 3, &le(&[1.0, 10.0, 2.0, 20.0, 3.0, 30.0])));
        assert_eq!((file.variables[0].rows, file.variables[0].columns), (3, 2));
        assert_same(values(&file, "Y:1"), &[1.0, 2.0, 3.0]);
        assert_same(values(&file, "Y:2"), &[10.0, 20.0, 30.0]);
    }

    #[test]
    fn last_of_two_variables_with_one_name_wins() {
        let file = read([level4(false, "y", 0, 1, 1, &le(&[1.0])), level4(false, "y", 0, 1, 1, &le(&[2.0]))].concat());
        assert_eq!(file.column_names(), ["y"]);
        assert_same(values(&file, "y"), &[2.0]);
    }

    #[test]
    fn name_of_a_matrix_or_a_column_beyond_it_is_refused() {
        let infinite = level4(false, "w", 0, 2, 1, &le(&[1.0, f64::INFINITY]));
        let file = read([level4(false, "Data", 0, 2, 2, &le(&[1.0; 4])), infinite].concat());
        let error = |name| file.column(name).unwrap_err().to_string();
        assert_eq!(error("Data"), "`Data` of data is a matrix with 2 columns of 2 samples; write `Data:1` to `Data:2`");
        assert_eq!(error("Data:3"), "no column `Data:3` in data; did you mean `Data:1`?");
        assert_eq!(error("Data:0"), "no column `Data:0` in data; did you mean `Data:1`?");
        assert_eq!(error("w"), "column `w` of data is infinite in row 2; write NaN for a gap");
    }
}

const DOUBLE: u32 = 6;
const MATRIX: u32 = 14;

fn level5(big_endian: bool, elements: &[Vec<u8>]) -> Vec<u8> {
    let mut file = vec![b' '; 124];
    file[..10].copy_from_slice(b"MATLAB 5.0");
    file.extend(if big_endian { b"\x01\x00MI" } else { b"\x00\x01IM" });
    file.extend(elements.concat());
    file
}

fn element(big_endian: bool, kind: u32, data: &[u8]) -> Vec<u8> {
    let mut element = [word(big_endian, kind), word(big_endian, data.len() as u32)].concat();
    element.extend(data);
    element.resize(element.len().next_multiple_of(8), 0);
    element
}

/// Returns an array of a class with flags; `data` are its elements after the name.
fn array(big_endian: bool, class: u32, sizes: &[u32], name: &str, data: &[u8]) -> Vec<u8> {
    let flags = [word(big_endian, class), word(big_endian, 0)].concat();
    let sizes: Vec<u8> = sizes.iter().flat_map(|size| word(big_endian, *size)).collect();
    let parts = [
        element(big_endian, 6, &flags),
        element(big_endian, 5, &sizes),
        element(big_endian, 1, name.as_bytes()),
        data.to_vec(),
    ];
    element(big_endian, MATRIX, &parts.concat())
}

fn doubles(name: &str, rows: u32, columns: u32, values: &[f64]) -> Vec<u8> {
    array(false, DOUBLE, &[rows, columns], name, &element(false, 9, &le(values)))
}

fn compressed(array: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(array).unwrap();
    let data = encoder.finish().unwrap();
    // N.B.: a compressed element is not padded.
    [&word(false, 15)[..], &word(false, data.len() as u32), &data].concat()
}

fn cell(name: &str, cells: &[Vec<u8>]) -> Vec<u8> {
    array(false, 1, &[1, cells.len() as u32], name, &cells.concat())
}

mod mat5 {
    use super::*;
    use mops_math as math;

    #[test]
    fn plain_and_compressed_and_both_byte_orders_give_the_same_columns() {
        let plain = doubles("y", 3, 1, &[1.0, -2.5, f64::NAN]);
        let big = array(true, DOUBLE, &[3, 1], "y", &element(true, 9, &be(&[1.0, -2.5, f64::NAN])));
        for file in [level5(false, &[compressed(&plain)]), level5(false, &[plain]), level5(true, &[big])] {
            let file = read(file);
            assert_eq!(file.format.to_string(), "MATLAB level 5");
            assert_same(values(&file, "y"), &[1.0, -2.5, f64::NAN]);
        }
    }

    #[test]
    fn every_class_and_every_storage_is_read() {
        let bytes = |bytes: &[u8]| bytes.to_vec();
        let stored = [
            (1, 8, bytes(&(-3_i8).to_le_bytes()), -3.0),
            (2, 9, bytes(&[200]), 200.0),
            (3, 10, bytes(&(-300_i16).to_le_bytes()), -300.0),
            (4, 11, bytes(&60_000_u16.to_le_bytes()), 60_000.0),
            (5, 12, bytes(&(-70_000_i32).to_le_bytes()), -70_000.0),
            (6, 13, bytes(&4_000_000_000_u32.to_le_bytes()), 4e9),
            (7, 7, bytes(&0.5_f32.to_le_bytes()), 0.5),
            (9, DOUBLE, le(&[0.1]), 0.1),
            (12, 14, bytes(&(-1_i64 << 40).to_le_bytes()), -math::powi(2.0, 40)),
            (13, 15, bytes(&(1_u64 << 63).to_le_bytes()), math::powi(2.0, 63)),
            // MATLAB stores doubles as the smallest sufficient integer type; a logical is a flagged uint8.
            (2, DOUBLE, bytes(&[42]), 42.0),
            (2, 0x0200 + 9, bytes(&[1]), 1.0),
        ];
        for (kind, class, data, expected) in stored {
            let array = array(false, class, &[1, 1], "y", &element(false, kind, &data));
            assert_same(values(&read(level5(false, &[array])), "y"), &[expected]);
        }
    }

    #[test]
    fn small_elements_are_read() {
        for big_endian in [false, true] {
            let small = |kind: u32, data: &[u8]| {
                let data = [data, &[0; 4][data.len()..]].concat();
                [&word(big_endian, (data.iter().filter(|byte| **byte != 0).count() as u32) << 16 | kind)[..], &data]
                    .concat()
            };
            let flags = [word(big_endian, DOUBLE), word(big_endian, 0)].concat();
            let sizes = [word(big_endian, 3), word(big_endian, 1)].concat();
            let parts = [
                element(big_endian, 6, &flags),
                element(big_endian, 5, &sizes),
                small(1, b"abc"),
                small(2, &[7, 8, 9]),
            ];
            let file = read(level5(big_endian, &[element(big_endian, MATRIX, &parts.concat())]));
            assert_same(values(&file, "abc"), &[7.0, 8.0, 9.0]);
        }
    }

    #[test]
    fn cells_are_variables_with_their_number_in_the_name() {
        let inner = cell("", &[doubles("", 1, 1, &[5.0])]);
        let text = array(false, 4, &[1, 1], "", &element(false, 4, &[65, 0]));
        let swings = [
            doubles("", 2, 1, &[1.0, 2.0]),
            doubles("", 2, 2, &[1.0, 2.0, 3.0, 4.0]),
            text,
            element(false, MATRIX, &[]),
            inner,
        ];
        let file = read(level5(false, &[compressed(&cell("Y_id", &swings))]));
        assert_eq!(file.column_names(), ["Y_id{1}", "Y_id{2}:1", "Y_id{2}:2", "Y_id{5}{1}"]);
        assert_eq!(file.skipped, ["Y_id{3}: text", "Y_id{4}: empty"]);
        assert_same(values(&file, "Y_id{1}"), &[1.0, 2.0]);
        assert_same(values(&file, "Y_id{2}:2"), &[3.0, 4.0]);
        assert_same(values(&file, "Y_id{5}{1}"), &[5.0]);
    }

    #[test]
    fn one_unreadable_variable_does_not_spoil_the_others() {
        let named = |class, name| array(false, class, &[1, 1], name, &[]);
        let opaque = [element(false, 6, &[17, 0, 0, 0, 0, 0, 0, 0]), element(false, 1, b"table")].concat();
        let mut broken = compressed(&doubles("lost", 1, 1, &[1.0]));
        let end = broken.len();
        broken[end - 1] ^= 1;
        let elements = [
            named(2, "structure"),
            named(3, "thing"),
            named(4, "note"),
            named(5, "sparse"),
            named(0x0800 + DOUBLE, "complex"),
            named(16, "function"),
            element(false, MATRIX, &opaque),
            named(99, "news"),
            array(false, DOUBLE, &[1, 1, 2], "deep", &[]),
            array(false, DOUBLE, &[2, 2], "short", &element(false, 9, &le(&[1.0]))),
            array(false, DOUBLE, &[u32::MAX, u32::MAX], "vast", &element(false, 9, &le(&[1.0]))),
            array(false, DOUBLE, &[1, 1], "kind", &element(false, 8, &le(&[1.0]))),
            array(false, DOUBLE, &[0, 0], "none", &element(false, 9, &[])),
            array(false, 1, &[1, 2], "cells", &doubles("", 1, 1, &[3.0])),
            element(false, 77, &[0; 8]),
            element(false, MATRIX, &[1, 2, 3]),
            broken,
            compressed(&[1, 2, 3]),
            doubles("y", 1, 1, &[7.0]),
        ];
        let file = read(level5(false, &elements));
        assert_eq!(file.column_names(), ["cells{1}", "y"]);
        let expected = [
            "structure: a struct",
            "thing: an object",
            "note: text",
            "sparse: a sparse matrix",
            "complex: complex numbers",
            "function: a function",
            "table: an object (table, string, datetime or the like)",
            "news: an array of unknown class 99",
            "deep: an array with 3 dimensions",
            "short: damaged",
            "vast: damaged",
            "kind: numbers of unknown type 8",
            "none: empty",
            "cells: damaged from element 2 on",
            "variable 15: an element of unknown type 77",
            "variable 16: damaged",
            "variable 17: damaged: decompression failed (corrupt deflate stream)",
            "variable 18: damaged",
        ];
        assert_eq!(file.skipped, expected);
    }

    #[test]
    fn file_that_ends_too_early_is_refused() {
        let file = level5(false, &[doubles("t", 1, 1, &[1.0]), compressed(&doubles("y", 3, 1, &[1.0, 2.0, 3.0]))]);
        let cut_off = |k| {
            format!(
                "data: the file ends inside variable {k}: it is cut off or damaged; copy it again, or save it again"
            )
        };
        assert_eq!(error(&file[..file.len() - 1]).0, cut_off(2));
        assert_eq!(error(&file[..130]).0, cut_off(1));
        assert_eq!(error("MATLAB 5.0 MAT-file, Platform").0, cut_off(1));
        assert_eq!(read([file, vec![0; 13]].concat()).column_names(), ["t", "y"]);
    }

    #[test]
    fn file_without_numbers_is_refused() {
        let note = array(false, 4, &[1, 1], "note", &[]);
        let found = |found: &str| {
            let fact = "data: the MATLAB level 5 file contains no numeric matrix";
            format!("{fact} (found: {found}); save real, full matrices as separate variables")
        };
        assert_eq!(error(level5(false, &[note])).0, found("note: text"));
        assert_eq!(error(level5(false, &[])).0, found("nothing"));
    }

    #[test]
    fn what_grows_beyond_the_budget_is_skipped() {
        let file = level5(false, &[compressed(&doubles("large", 1000, 1, &[0.0; 1000])), doubles("y", 1, 1, &[7.0])]);
        let reading = |budget| super::super::mat5::read_within(&file, budget).unwrap().finish();
        assert_eq!(reading(20_000).0.len(), 2);
        let (variables, skipped) = reading(10_000);
        assert_eq!((variables.len(), skipped), (1, vec!["large: too large in memory".to_owned()]));
    }

    #[test]
    fn cells_nested_without_end_are_refused() {
        let nested = (0..100).fold(doubles("", 1, 1, &[1.0]), |inner, _| cell("", &[inner]));
        let file = read(level5(false, &[cell("c", &[nested]), doubles("y", 1, 1, &[7.0])]));
        assert_eq!(file.column_names(), ["y"]);
        assert!(file.skipped[0].ends_with("{1}{1}: cells nested deeper than 32"), "{:?}", file.skipped);
    }
}

/// Reads a file and requests everything; any result except a panic is fine.
fn exercise(bytes: Vec<u8>) {
    match DataFile::parse("data", bytes) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(file) => {
            for name in file.column_names() {
                let Ok(column) = file.column(&name) else { continue };
                for (row, value) in column.values.iter().enumerate() {
                    let cell = &file.source.text[file.span_of(&name, row)];
                    let number = cell.replace('"', "").trim().replace(',', ".").parse();
                    assert!(value.is_nan() || number == Ok(*value) || file.format != Format::Csv, "{cell:?} {value}");
                }
            }
        }
    }
}

fn good_files() -> [Vec<u8>; 4] {
    let wide = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let elements = [
        doubles("t", 6, 1, &wide),
        cell("Y", &[doubles("", 2, 3, &wide), cell("", &[doubles("", 3, 2, &wide)])]),
        array(false, 9, &[2, 2], "b", &element(false, 2, &[1, 2, 3, 4])),
    ];
    [
        b"\xef\xbb\xbf# rig\r\nt[s];\"u[N*m]\";how\r\n0;1,5;x\r\n1;;\"y\"\"z\"\r\n2;NaN;\n".to_vec(),
        [level4(false, "t", 0, 2, 3, &le(&wide)), level4(true, "note", 51, 1, 2, b"hi")].concat(),
        level5(false, &elements),
        level5(false, &elements.each_ref().map(|array| compressed(array))),
    ]
}

proptest! {
    #![proptest_config(mops_tiers::property(2_560))]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        exercise(bytes.clone());
        exercise([level4(false, "t", 0, 1, 1, &le(&[1.0])), bytes.clone()].concat());
        exercise(level5(false, std::slice::from_ref(&bytes)));
        exercise(level5(true, &[element(true, MATRIX, &bytes)]));
        exercise(level5(false, &[compressed(&element(false, MATRIX, &bytes))]));
    }

    #[test]
    fn arbitrary_cells_are_found_at_their_positions(text in "[\",;\t\n\r a1#\u{b0}]{0,80}") {
        exercise(text.clone().into_bytes());
        exercise(format!("a,b\n1,1\n{text}").into_bytes());
    }

    #[test]
    fn mutated_and_cut_files_never_panic(
        changes in prop::collection::vec((any::<Index>(), prop_oneof![Just(0), Just(255), any::<u8>()]), 0..6),
        end in any::<Index>(),
    ) {
        for mut file in good_files() {
            for (place, byte) in &changes {
                let place = place.index(file.len());
                file[place] = *byte;
            }
            exercise(file.clone());
            file.truncate(end.index(file.len()));
            exercise(file);
        }
    }
}

#[test]
fn unharmed_files_of_the_property_tests_are_read() {
    let names = good_files().map(|file| read(file).column_names().join(" "));
    let level5 = "t Y{1}:1 Y{1}:2 Y{2}{1}:1 Y{2}{1}:2 b:1 b:2";
    assert_eq!(names, ["t u", "t:1 t:2", level5, level5]);
}
