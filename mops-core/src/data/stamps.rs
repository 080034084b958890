//! Time stamps: `2024-05-17T10:30:00.5+02:00`, `17.05.2024 10:30`, `5/17/2024 10:30:00 AM`, `2024-05-17` and `10:30:00.5`.

/// Nanoseconds in a second.
const SECOND: i64 = 1_000_000_000;

/// Nanoseconds in a day.
const DAY: i64 = 86_400 * SECOND;

/// Instant that the time stamps of a column count from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// Midnight of an unknown day: times of day without a date.
    Midnight,
    /// 1970-01-01 of a local time: dates without a zone.
    Local,
    /// 1970-01-01 of universal time: dates with a zone.
    Universal,
}

/// First time stamp of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Time since the reference, ns.
    pub nanoseconds: i64,
    /// Reference.
    pub reference: Reference,
}

/// Parts of a time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    date: Option<Date>,
    /// Time of day, ns.
    time: Option<i64>,
    /// Zone: time east of universal time, ns.
    zone: Option<i64>,
}

/// Date as written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Date {
    /// Year, month and day.
    Ordered([i64; 3]),
    /// Year, and day and month in an order that depends on the country.
    Unordered(i64, [i64; 2]),
}

/// Order of day and month in the dates of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    DayFirst,
    MonthFirst,
}

/// Time stamps of a column.
#[derive(Debug)]
pub(super) struct Column {
    /// Time of each row since the reference, ns; `None` for a gap.
    pub nanoseconds: Vec<Option<i64>>,
    pub reference: Reference,
    /// True for dates without a time of day.
    pub is_dates: bool,
}

/// Reads the cells of a column; an empty cell is `None`. Returns `None` if a cell is no time stamp, and the reason if the stamps have
/// no common clock.
pub(super) fn column<'t>(cells: impl Iterator<Item = Option<&'t str>>) -> Option<Result<Column, String>> {
    let mut stamps: Vec<Option<(Stamp, &str)>> = Vec::new();
    for cell in cells {
        stamps.push(match cell {
            Some(text) => Some((stamp(text)?, text.trim())),
            None => None,
        });
    }
    let given = || stamps.iter().flatten();
    let (first, text) = *given().next()?;
    if let Some((_, other)) = given().find(|(stamp, _)| stamp.kind() != first.kind()) {
        let what = match given().any(|(stamp, _)| stamp.date.is_none()) {
            true => "time stamps with and without a date are mixed",
            false => "time stamps with and without a zone are mixed",
        };
        return Some(Err(format!("{what} (`{text}` and `{other}`)")));
    }
    let order = match order(given().filter_map(|(stamp, _)| stamp.date))? {
        Ok(order) => order,
        Err(()) => {
            return Some(Err(format!(
                "`{text}` and all other dates may be day/month or month/day; write them as year-month-day"
            )));
        }
    };
    let nanoseconds: Option<Vec<Option<i64>>> = stamps
        .iter()
        .map(|stamp| match stamp {
            Some((stamp, _)) => stamp.nanoseconds(order).map(Some),
            None => Some(None),
        })
        .collect();
    let reference = match (first.date, first.zone) {
        (None, _) => Reference::Midnight,
        (_, None) => Reference::Local,
        _ => Reference::Universal,
    };
    let is_dates = given().all(|(stamp, _)| stamp.time.is_none());
    Some(Ok(Column { nanoseconds: nanoseconds?, reference, is_dates }))
}

/// Returns the order of day and month that suits all dates; an error if both do, and `None` if neither does.
fn order(dates: impl Iterator<Item = Date>) -> Option<Result<Order, ()>> {
    let pairs: Vec<[i64; 2]> =
        dates.filter_map(|date| if let Date::Unordered(_, pair) = date { Some(pair) } else { None }).collect();
    let day_first = pairs.iter().all(|[_, month]| *month <= 12);
    let month_first = pairs.iter().all(|[month, _]| *month <= 12);
    match (day_first, month_first) {
        (true, true) if pairs.iter().any(|[a, b]| a != b) => Some(Err(())),
        (true, _) => Some(Ok(Order::DayFirst)),
        (_, true) => Some(Ok(Order::MonthFirst)),
        _ => None,
    }
}

/// Returns true if a text is a time stamp.
pub(super) fn is_stamp(text: &str) -> bool {
    stamp(text).is_some()
}

impl Stamp {
    /// Returns which parts are given that determine the clock; a date alone is its midnight.
    fn kind(&self) -> [bool; 2] {
        [self.date.is_some(), self.zone.is_some()]
    }

    /// Returns the time since the reference; `None` if there is no such day.
    fn nanoseconds(&self, order: Order) -> Option<i64> {
        let days = match self.date {
            None => 0,
            Some(Date::Ordered(date)) => days(date)?,
            Some(Date::Unordered(year, [a, b])) => days(match order {
                Order::DayFirst => [year, b, a],
                Order::MonthFirst => [year, a, b],
            })?,
        };
        days.checked_mul(DAY)?.checked_add(self.time.unwrap_or(0) - self.zone.unwrap_or(0))
    }
}

/// Reads a time stamp. Sources: ISO 8601 as restricted by RFC 3339; dates with dots are day.month.year (DIN 1355-1).
fn stamp(text: &str) -> Option<Stamp> {
    let text = text.trim().trim_matches('"').trim();
    let Some((date, rest)) = date(text) else {
        let (time, rest) = time_of_day(text)?;
        return rest.is_empty().then_some(Stamp { date: None, time: Some(time), zone: None });
    };
    if rest.is_empty() {
        return Some(Stamp { date: Some(date), time: None, zone: None });
    }
    let rest = rest.strip_prefix(',').unwrap_or(rest);
    let rest = rest.strip_prefix(['T', 't', ' ', '_'])?.trim_start();
    let (time, rest) = time_of_day(rest)?;
    let zone = if rest.is_empty() { None } else { Some(zone(rest)?) };
    Some(Stamp { date: Some(date), time: Some(time), zone })
}

/// Reads a number of at most `most` digits.
fn digits(text: &str, most: usize) -> Option<(i64, usize, &str)> {
    let count = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let number = (1..=most).contains(&count).then(|| text[..count].parse().ok()).flatten()?;
    Some((number, count, &text[count..]))
}

fn date(text: &str) -> Option<(Date, &str)> {
    let (first, width, rest) = digits(text, 4)?;
    let mark = rest.chars().next().filter(|mark| "-/.".contains(*mark))?;
    let (second, second_width, rest) = digits(&rest[1..], 2)?;
    let (third, third_width, rest) = digits(rest.strip_prefix(mark)?, 4)?;
    let is_day_or_month = |value: i64, width: usize| width <= 2 && (1..=31).contains(&value);
    if !is_day_or_month(second, second_width) {
        return None;
    }
    let date = match (width, third_width) {
        (4, 1 | 2) if is_day_or_month(third, third_width) => Date::Ordered([first, second, third]),
        (1 | 2, 4) if is_day_or_month(first, width) => match mark {
            '.' => Date::Ordered([third, second, first]),
            _ => Date::Unordered(third, [first, second]),
        },
        _ => return None,
    };
    // An ordered date is checked at once, so that a number such as 1.99.2000 is none.
    if let Date::Ordered(date) = date {
        days(date)?;
    }
    Some((date, rest))
}

/// Reads a time of day with minutes, and returns it in ns.
fn time_of_day(text: &str) -> Option<(i64, &str)> {
    let (hour, _, rest) = digits(text, 2)?;
    let (minute, width, mut rest) = digits(rest.strip_prefix(':')?, 2)?;
    let (mut second, mut fraction) = (0, 0);
    if width != 2 || minute > 59 {
        return None;
    }
    if let Some(after) = rest.strip_prefix(':') {
        let (value, width, after) = digits(after, 2)?;
        // 60 is a leap second.
        if width != 2 || value > 60 {
            return None;
        }
        (second, rest) = (value, after);
        if let Some(after) = rest.strip_prefix(['.', ',']) {
            let count = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
            // Digits beyond ns are dropped.
            let shown = &after[..count.min(9)];
            let scale = 10_i64.pow(9 - u32::try_from(shown.len()).expect("at most 9"));
            fraction = shown.parse::<i64>().ok()? * scale;
            rest = &after[count..];
        }
    }
    let rest = rest.trim_start();
    let half = [("am", 0), ("pm", 12), ("a.m.", 0), ("p.m.", 12)];
    let after_half = |mark: &str| {
        let head = rest.get(..mark.len())?;
        head.eq_ignore_ascii_case(mark).then(|| rest[mark.len()..].trim_start())
    };
    let (hour, rest) = match half.iter().find_map(|(mark, hours)| Some((hours, after_half(mark)?))) {
        Some((hours, after)) if (1..=12).contains(&hour) => (hour % 12 + hours, after),
        Some(_) => return None,
        None => (hour, rest),
    };
    (hour < 24).then_some((((hour * 60 + minute) * 60 + second) * SECOND + fraction, rest))
}

/// Reads a zone, and returns the time east of universal time, ns.
fn zone(text: &str) -> Option<i64> {
    let text = text.trim();
    if ["z", "utc", "gmt"].iter().any(|universal| text.eq_ignore_ascii_case(universal)) {
        return Some(0);
    }
    let text = text.strip_prefix("UTC").unwrap_or(text);
    let sign = match text.as_bytes().first()? {
        b'+' => 1,
        b'-' => -1,
        _ => return None,
    };
    let (hours, minutes) = match (text[1..].split_once(':'), text.len()) {
        (Some((hours, minutes)), _) => (hours, minutes),
        (None, 3) => (&text[1..], "0"),
        (None, 5) => (text.get(1..3)?, text.get(3..)?),
        _ => return None,
    };
    let [hours, minutes] = [hours, minutes].map(|part| digits(part, 2).filter(|(.., rest)| rest.is_empty()));
    let (hours, minutes) = (hours?.0, minutes?.0);
    (hours < 24 && minutes < 60).then_some(sign * (hours * 60 + minutes) * 60 * SECOND)
}

/// Returns the days since 1970-01-01 in the Gregorian calendar; `None` if there is no such day.
///
/// Source: E. G. Richards, Calendars, in: Explanatory Supplement to the Astronomical Almanac, 3rd edition (2013), section 15.11.3.
fn days([year, month, day]: [i64; 3]) -> Option<i64> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[allow(clippy::cast_precision_loss)]
    fn seconds(text: &str) -> Option<f64> {
        let column = column([Some(text)].into_iter())?.ok()?;
        Some(column.nanoseconds[0]? as f64 * 1e-9)
    }

    #[test]
    fn stamps_count_from_1970_and_stand_for_one_instant_in_all_forms() {
        for (text, expected) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2000-03-01 00:00:00", 951_868_800.0),
            ("2024-02-29T23:59:59.25", 1_709_251_199.25),
            ("2024-02-29T23:59:59.25+01:30", 1_709_245_799.25),
            ("2024-02-29 23:59:59,25 +0130", 1_709_245_799.25),
            ("29.02.2024 23:59:59.25", 1_709_251_199.25),
            ("29/2/2024, 11:59:59.25 PM", 1_709_251_199.25),
            ("2/29/2024 11:59:59.25 pm", 1_709_251_199.25),
            ("2024/02/29 23:59:59.25 UTC", 1_709_251_199.25),
            ("29-02-2024 23:59:59.25", 1_709_251_199.25),
            ("\"1969-12-31 23:00:00\"", -3600.0),
            ("2024-05-17", 1_715_904_000.0),
            ("17.05.2024", 1_715_904_000.0),
            ("10:30:00.5", 37_800.5),
            ("12:00:00 AM", 0.0),
            ("12:05 PM", 43_500.0),
        ] {
            assert_eq!(seconds(text), Some(expected), "{text}");
        }
    }

    #[test]
    fn other_text_is_no_stamp() {
        for text in [
            "",
            "noon",
            "2024-13-01 00:00:00",
            "1.5",
            "1.234.567",
            "30.02.2024",
            "2024-02-30",
            "24:00:00",
            "10:61",
            "13:00 PM",
            "0:30 AM",
            "2024-05-17T10:30:00 CEST",
            "17.05.24",
            "10:30.5",
            "10:30:00Z",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }

    fn read(cells: &[&str]) -> Result<Column, String> {
        column(cells.iter().map(|cell| (!cell.is_empty()).then_some(*cell))).expect("they are stamps")
    }

    #[test]
    fn one_date_decides_the_order_of_day_and_month_of_all() {
        let day = |cells: &[&str]| read(cells).unwrap().nanoseconds[0].unwrap() / DAY;
        assert_eq!(day(&["01/02/2024", "13/02/2024"]), day(&["2024-02-01"]));
        assert_eq!(day(&["01/02/2024", "01/13/2024"]), day(&["2024-01-02"]));
        assert_eq!(day(&["05/05/2024"]), day(&["2024-05-05"]));
        assert!(read(&["05/01/2024 11:50:00 AM", "05/02/2024 11:50:00 AM"]).unwrap_err().contains("day/month"));
        assert!(column([Some("13/02/2024"), Some("02/13/2024")].into_iter()).is_none());
    }

    #[test]
    fn stamps_of_one_column_have_one_clock() {
        assert!(read(&["2024-05-17T10:30:00Z", "", "2024-05-17T10:30:01+02:00"]).is_ok());
        for (other, fact) in [
            ("2024-05-17T10:30:01", "without a zone"),
            ("10:30:01", "without a date"),
            ("2024-05-17", "without a zone"),
        ] {
            let why = read(&["2024-05-17T10:30:00Z", other]).unwrap_err();
            assert!(why.contains(fact), "{why}");
        }
    }
}
