//! Calendar: days of dates, and names of months and weekdays.

/// Returns the days since 1970-01-01 in the Gregorian calendar; `None` if there is no such day.
///
/// Source: E. G. Richards, Calendars, in: Explanatory Supplement to the Astronomical Almanac, 3rd edition (2013),
/// section 15.11.3.
pub(super) fn days([year, month, day]: [i64; 3]) -> Option<i64> {
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let length = match month {
        2 => 28 + i64::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return None,
    };
    if !(1..=length).contains(&day) {
        return None;
    }
    // Years that begin in March, so that a leap day is the last day of one.
    let (year, month) = if month <= 2 { (year - 1, month + 9) } else { (year, month - 3) };
    let leaps = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(365 * year + leaps + (153 * month + 2) / 5 + day - 719_469)
}

/// Names of the months in the languages of [`super::header`]: English, German, French, Spanish, Italian and Dutch.
const MONTHS: [&str; 12] = [
    "january januar jänner janvier enero gennaio januari",
    "february februar février fevrier febrero febbraio februari",
    "march märz maerz mrz mars marzo maart mrt",
    "april avril abril aprile",
    "may mai mayo maggio mei",
    "june juni juin junio giugno",
    "july juli juillet julio luglio",
    "august août aout agosto augustus",
    "september septembre septiembre settembre",
    "october oktober octobre octubre ottobre",
    "november novembre noviembre",
    "december dezember décembre decembre diciembre dicembre",
];

/// Names of the days of the week in the same languages.
const WEEKDAYS: &str = "monday tuesday wednesday thursday friday saturday sunday montag dienstag mittwoch donnerstag freitag samstag \
                        sonnabend sonntag lundi mardi mercredi jeudi vendredi samedi dimanche lunes martes miércoles jueves viernes \
                        sábado domingo lunedì martedì mercoledì giovedì venerdì sabato domenica maandag dinsdag woensdag donderdag \
                        vrijdag zaterdag zondag";

/// Returns true for a name or its abbreviation of at least `letters` letters.
fn is_short_for(text: &str, name: &str, letters: usize) -> bool {
    text.chars().count() >= letters && name.starts_with(text)
}

/// Returns the number of a month from its name, or from an abbreviation of three letters or more that suits no other
/// month.
pub(super) fn month(text: &str) -> Option<i64> {
    let text = text.to_lowercase();
    let suits = |names: &&str| names.split(' ').any(|name| is_short_for(&text, name, 3));
    let mut found = (1..).zip(MONTHS).filter(|(_, names)| suits(names)).map(|(number, _)| number);
    found.next().filter(|_| found.next().is_none())
}

/// Returns true for the name of a day of the week, or an abbreviation of two letters or more.
pub(super) fn is_weekday(text: &str) -> bool {
    let text = text.to_lowercase();
    WEEKDAYS.split_whitespace().any(|name| is_short_for(&text, name, 2))
}
