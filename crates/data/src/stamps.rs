//! Time stamps: `2024-05-17T10:30:00.5+02:00`, `17.05.2024 10:30`, `17-May-24`, `5/17/2024 10:30:00 AM`,
//! `20240517T103000`, `2024-05-17` and `10:30:00.5`.

use mops_language::Unit;

use super::calendar::{days, is_weekday, month};

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
struct Stamp {
    date: Option<Date>,
    time: Option<Time>,
    /// Zone: time east of universal time, ns.
    zone: Option<i64>,
}

/// Time of day, or elapsed time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Time {
    nanoseconds: i64,
    clock: ClockFormat,
}

/// Date as written: its three numbers, with the number of digits of each; a month given by its name has 0 digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Date {
    parts: [(i64, usize); 3],
    /// Orders that the form of the date admits.
    orders: &'static [Order],
}

/// Order of the numbers of a date, by the first of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Day,
    Month,
    Year,
}

impl Order {
    const ALL: [Self; 3] = [Self::Day, Self::Month, Self::Year];

    /// Returns the positions of year, month and day.
    fn positions(self) -> [usize; 3] {
        match self {
            Self::Day => [2, 1, 0],
            Self::Month => [2, 0, 1],
            Self::Year => [0, 1, 2],
        }
    }

    fn shown(self) -> &'static str {
        match self {
            Self::Day => "day/month",
            Self::Month => "month/day",
            Self::Year => "year/month/day",
        }
    }
}

/// Units of the numbers between colons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ClockFormat {
    HoursMinutes,
    HoursMinutesSeconds,
    MinutesSeconds,
}

/// Form of the cells of a column, as its header gives it in place of a unit: `hh:mm:ss`, `min:sec`, `dd/mm/yyyy hh:mm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form {
    order: Option<Order>,
    clock: Option<ClockFormat>,
}

impl Form {
    /// Reads a form.
    pub fn parse(text: &str) -> Option<Self> {
        let mut form = Self { order: None, clock: None };
        for part in text.split_whitespace() {
            match part.contains(':') {
                true if form.clock.is_none() => form.clock = Some(clock(part)?),
                false if form.order.is_none() => form.order = Some(date_order(part)?),
                _ => return None,
            }
        }
        (form.order.is_some() || form.clock.is_some()).then_some(form)
    }

    /// Returns true if a stamp has this form; a form of the time alone leaves the date open.
    fn admits(self, stamp: &Stamp) -> bool {
        let time = |clock: ClockFormat| match stamp.time {
            Some(time) => time.clock == clock,
            None => stamp.date.is_some() && clock != ClockFormat::MinutesSeconds,
        };
        self.clock.is_none_or(time) && self.order.is_none_or(|order| stamp.date.is_some_and(|date| date.is_in(order)))
    }
}

/// Reads the form of a time, such as `hh:mm:ss.000` or `Min:Sek`.
fn clock(text: &str) -> Option<ClockFormat> {
    let text = text.split(['.', ',']).next()?.to_lowercase();
    let unit = |part: &str| match part.chars().next().filter(|_| part.chars().all(char::is_alphabetic))? {
        _ if part == "std" => Some('h'),
        letter => Some(letter),
    };
    match text.split(':').map(unit).collect::<Option<Vec<char>>>()?[..] {
        ['h', 'm'] => Some(ClockFormat::HoursMinutes),
        ['h', 'm', 's'] => Some(ClockFormat::HoursMinutesSeconds),
        ['m', 's'] => Some(ClockFormat::MinutesSeconds),
        _ => None,
    }
}

/// Reads the form of a date, such as `dd/mm/yyyy` or `TT.MM.JJ`.
fn date_order(text: &str) -> Option<Order> {
    let parts: Vec<String> = text.split(['-', '/', '.']).map(str::to_lowercase).collect();
    let part = |text: &String| {
        let letter = text.chars().next().filter(|first| text.len() <= 4 && text.chars().all(|c| c == *first))?;
        ["yja", "m", "dt"].iter().position(|letters| letters.contains(letter))
    };
    let found: Vec<usize> = parts.iter().map(part).collect::<Option<_>>()?;
    Order::ALL.into_iter().find(|order| {
        let positions = order.positions();
        found.len() == 3 && (0..3).all(|part| found[positions[part]] == part) && parts[positions[0]].len() > 1
    })
}

/// Time stamps of a column.
#[derive(Debug)]
pub(super) struct Column {
    /// Time of each row since the reference, ns; `None` for a gap.
    pub nanoseconds: Vec<Option<i64>>,
    /// Reference; `None` for elapsed times.
    pub reference: Option<Reference>,
    /// True for dates without a time of day, or with midnight throughout, as spreadsheets write them.
    pub is_dates: bool,
}

/// Reads the cells of a column; an empty cell is `None`. `unit` is that of the header. Returns `None` if a cell is no
/// time stamp, and the reason if the stamps have no common clock or contradict the header.
pub(super) fn column<'t>(
    cells: impl Iterator<Item = Option<&'t str>>,
    unit: Option<&str>,
) -> Option<Result<Column, String>> {
    let form = unit.and_then(Form::parse);
    let is_elapsed = form.is_some_and(|form| form.clock == Some(ClockFormat::MinutesSeconds));
    let mut stamps: Vec<Option<(Stamp, &str)>> = Vec::new();
    for cell in cells {
        stamps.push(match cell {
            Some(text) => Some((if is_elapsed { elapsed(text) } else { None }.or_else(|| stamp(text))?, text.trim())),
            None => None,
        });
    }
    let given = || stamps.iter().flatten();
    let (first, text) = *given().next()?;
    if let Some(unit) = unit
        && let Some((_, other)) = given().find(|(stamp, _)| contradicts(stamp, unit, form))
    {
        return Some(Err(format!(
            "`{other}` contradicts `{unit}` in the header; write the form of the cells there, such as [hh:mm:ss] or [mm:ss]"
        )));
    }
    if let Some((_, other)) = given().find(|(stamp, _)| stamp.kind() != first.kind()) {
        let what = match given().any(|(stamp, _)| stamp.date.is_none()) {
            true => "time stamps with and without a date are mixed",
            false => "time stamps with and without a zone are mixed",
        };
        return Some(Err(format!("{what} (`{text}` and `{other}`)")));
    }
    let dates: Vec<Date> = given().filter_map(|(stamp, _)| stamp.date).collect();
    let days = match readings(&dates, form.and_then(|form| form.order)).as_slice() {
        [] => return None,
        [(_, days)] => days.clone(),
        several => {
            let orders: Vec<&str> = several.iter().map(|(order, _)| order.shown()).collect();
            return Some(Err(format!(
                "`{text}` and all other dates may be {}; write them as year-month-day",
                orders.join(" or ")
            )));
        }
    };
    let mut days = days.into_iter();
    let mut nanoseconds = |stamp: &Stamp| {
        let days = if stamp.date.is_some() { days.next()? } else { 0 };
        let time = stamp.time.map_or(0, |time| time.nanoseconds);
        days.checked_mul(DAY)?.checked_add(time - stamp.zone.unwrap_or(0))
    };
    let nanoseconds: Option<Vec<Option<i64>>> =
        stamps.iter().map(|cell| cell.as_ref().map_or(Some(None), |(stamp, _)| nanoseconds(stamp).map(Some))).collect();
    let reference = match (first.date, first.zone) {
        _ if is_elapsed => None,
        (None, _) => Some(Reference::Midnight),
        (_, None) => Some(Reference::Local),
        _ => Some(Reference::Universal),
    };
    let is_dates =
        given().all(|(stamp, _)| stamp.date.is_some() && stamp.time.is_none_or(|time| time.nanoseconds == 0));
    Some(Ok(Column { nanoseconds: nanoseconds?, reference, is_dates }))
}

/// Returns true if a stamp has not the form in the header, or is a time of day under a unit.
fn contradicts(stamp: &Stamp, unit: &str, form: Option<Form>) -> bool {
    match form {
        Some(form) => !form.admits(stamp),
        None => stamp.date.is_none() && (unit.contains(':') || Unit::parse(unit).is_ok()),
    }
}

/// Returns the days since 1970-01-01 of all dates, in each order that suits them, or in that of the header; equal days
/// count once.
fn readings(dates: &[Date], stated: Option<Order>) -> Vec<(Order, Vec<i64>)> {
    let mut found: Vec<(Order, Vec<i64>)> = Vec::new();
    for order in Order::ALL.into_iter().filter(|order| stated.is_none_or(|stated| stated == *order)) {
        let read = |date: &Date| match (stated, date.orders) {
            (None, [own]) => date.in_order(*own),
            (None, orders) if !orders.contains(&order) => None,
            _ => date.in_order(order),
        };
        let Some(read) = dates.iter().map(read).collect::<Option<Vec<[i64; 3]>>>() else { continue };
        let days: Vec<i64> = read.iter().filter_map(|date| days(*date)).collect();
        let is_likely = stated.is_some() || !(is_yearly(&read) && dates.iter().any(Date::is_short));
        if is_likely && !found.iter().any(|(_, known)| *known == days) {
            found.push((order, days));
        }
    }
    found
}

/// Returns true if dates differ in the year alone: a number of two digits that counts up is a day rather than a year.
fn is_yearly(dates: &[[i64; 3]]) -> bool {
    dates.windows(2).all(|pair| pair[0][1..] == pair[1][1..]) && dates.windows(2).any(|pair| pair[0][0] != pair[1][0])
}

/// Returns true if a text is a time stamp.
pub(super) fn is_stamp(text: &str) -> bool {
    stamp(text).is_some()
}

/// Returns true for a text that is meant as a date, whether it can be read or not, such as `31.02.24`, `13/05` or
/// `Mon 13. Mai`.
pub(super) fn is_like_date(text: &str) -> bool {
    let text = text.trim().trim_matches('"').trim();
    // A colon belongs to a time of day; the words for year, month and day in Chinese and Japanese are marks.
    let is_mark = |c: char| c != ':' && (!c.is_alphanumeric() || "\u{5e74}\u{6708}\u{65e5}".contains(c));
    let parts: Vec<&str> = text.split(is_mark).filter(|part| !part.is_empty()).collect();
    let is_number = |part: &&str| part.bytes().all(|byte| byte.is_ascii_digit());
    let (numbers, names): (Vec<&str>, Vec<&str>) = parts.into_iter().partition(is_number);
    let has_year = [numbers.first(), numbers.last()].into_iter().flatten().any(|part| matches!(part.len(), 2 | 4));
    let is_day = |part: &&str| part.parse::<i64>().is_ok_and(|day| (1..=31).contains(&day));
    names.iter().all(|name| month(name).is_some() || is_weekday(name))
        && match numbers.len() {
            1 => !names.is_empty(),
            2 => !names.is_empty() || (numbers.iter().all(is_day) && !text.contains(',')),
            3 => has_year && numbers.iter().all(|number| number.len() <= 4),
            _ => false,
        }
}

/// Returns true for a date, and a time of day if there is one, in digits only: `20240517` and `20240517103000` (ISO
/// 8601, basic format).
pub(super) fn is_basic(text: &str, with_time: bool) -> bool {
    let digits = text.trim().split('.').next().unwrap_or_default();
    let fits = if with_time { matches!(digits.len(), 12 | 14) } else { digits.len() == 8 };
    fits && digits.bytes().all(|byte| byte.is_ascii_digit()) && is_stamp(text)
}

impl Stamp {
    /// Returns which parts are given that determine the clock; a date alone is its midnight.
    fn kind(&self) -> [bool; 2] {
        [self.date.is_some(), self.zone.is_some()]
    }
}

impl Date {
    /// Returns true if the number of digits of each part fits to an order.
    fn is_in(&self, order: Order) -> bool {
        let [year, month, day] = order.positions().map(|position| self.parts[position].1);
        let is_named = self.parts.iter().any(|(_, digits)| *digits == 0);
        matches!(year, 2 | 4) && (1..=2).contains(&day) && if is_named { month == 0 } else { month <= 2 }
    }

    /// Returns year, month and day in an order; `None` if there is no such day.
    fn in_order(&self, order: Order) -> Option<[i64; 3]> {
        let [(year, digits), (month, _), (day, _)] = order.positions().map(|position| self.parts[position]);
        let year = match digits {
            2 if year < PIVOT => 2000 + year,
            2 => 1900 + year,
            _ => year,
        };
        let date = [year, month, day];
        (self.is_in(order) && days(date).is_some()).then_some(date)
    }

    /// Returns true if the year has two digits.
    fn is_short(&self) -> bool {
        self.parts.iter().all(|(_, digits)| *digits <= 2)
    }
}

/// First year of two digits in the 20th century: 69 is 1969 and 68 is 2068. Source: POSIX.1-2017, `strptime`, `%y`.
const PIVOT: i64 = 69;

/// Reads a time stamp. Source: ISO 8601 as restricted by RFC 3339, and its basic format.
fn stamp(text: &str) -> Option<Stamp> {
    let text = text.trim().trim_matches('"').trim();
    let Some((date, rest, is_basic)) = basic_date(text).or_else(|| date(text)) else {
        let (time, rest) = time_of_day(text)?;
        return rest.is_empty().then_some(Stamp { date: None, time: Some(time), zone: None });
    };
    if rest.is_empty() {
        return Some(Stamp { date: Some(date), time: None, zone: None });
    }
    let rest = rest.strip_prefix(',').unwrap_or(rest);
    let (time, rest) = match rest.strip_prefix(['T', 't', ' ', '_']) {
        Some(rest) if is_basic => basic_time(rest.trim_start()).or_else(|| time_of_day(rest.trim_start()))?,
        Some(rest) => time_of_day(rest.trim_start())?,
        None if is_basic => basic_time(rest)?,
        None => return None,
    };
    let zone = if rest.is_empty() { None } else { Some(zone(rest)?) };
    Some(Stamp { date: Some(date), time: Some(time), zone })
}

/// Reads a number of at most `most` digits.
fn digits(text: &str, most: usize) -> Option<(i64, usize, &str)> {
    let count = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let number = (1..=most).contains(&count).then(|| text[..count].parse().ok()).flatten()?;
    Some((number, count, &text[count..]))
}

/// Reads a date of 8 digits, which digits of a time of day may follow.
fn basic_date(text: &str) -> Option<(Date, &str, bool)> {
    let (_, count, _) = digits(text, 14)?;
    let number = |range: std::ops::Range<usize>| Some((text[range.clone()].parse().ok()?, range.len()));
    if !matches!(count, 8 | 12 | 14) {
        return None;
    }
    let date = Date { parts: [number(0..4)?, number(4..6)?, number(6..8)?], orders: &[Order::Year] };
    date.in_order(Order::Year)?;
    Some((date, &text[8..], true))
}

/// Reads a time of day of 4 or 6 digits.
fn basic_time(text: &str) -> Option<(Time, &str)> {
    let (_, count, rest) = digits(text, 6)?;
    let spread = match count {
        4 => format!("{}:{}", &text[..2], &text[2..4]),
        6 => format!("{}:{}:{}", &text[..2], &text[2..4], &text[4..6]),
        _ => return None,
    };
    let (whole, _) = time_of_day(&spread)?;
    let (fraction, rest) = if count == 6 { fraction(rest)? } else { (0, rest) };
    Some((Time { nanoseconds: whole.nanoseconds + fraction, ..whole }, rest.trim_start()))
}

/// Reads a date with marks, or with the name of the month. Returns false, as it is not in the basic format.
fn date(text: &str) -> Option<(Date, &str, bool)> {
    let (first, rest) = part(text)?;
    let mark = rest.chars().next()?;
    let (second, rest) = part(after_marks(rest))?;
    let is_named = first.1 == 0 || second.1 == 0;
    let (third, rest) = match is_named {
        true => part(after_marks(rest))?,
        false => part(rest.strip_prefix(mark)?)?,
    };
    let parts = [first, second, third];
    let is_short = parts.iter().all(|(_, digits)| *digits <= 2);
    // Dates with dots are day.month.year (DIN 1355-1), and years of two digits come first between hyphens only (ISO
    // 8601:1988).
    let orders: &'static [Order] = match (mark, is_named) {
        (_, true) => &Order::ALL,
        ('.', _) => &[Order::Day, Order::Year],
        ('/' | '-', _) => &Order::ALL,
        _ => return None,
    };
    let is_open = |order: &Order| *order != Order::Year || !is_short || (mark == '-' && !is_named);
    let fits = |order: &Order| Date { parts, orders }.is_in(*order) && is_open(order);
    let orders: &'static [Order] = match Order::ALL.map(|order| orders.contains(&order) && fits(&order)) {
        [true, true, true] => &Order::ALL,
        [true, true, false] => &[Order::Day, Order::Month],
        [true, false, _] => &[Order::Day],
        [false, true, _] => &[Order::Month],
        [false, false, true] => &[Order::Year],
        _ => return None,
    };
    let date = Date { parts, orders };
    // A number such as 1.99.2000 is no date.
    orders.iter().find_map(|order| date.in_order(*order))?;
    Some((date, rest, false))
}

/// Returns the text after the marks beside the name of a month.
fn after_marks(text: &str) -> &str {
    text.trim_start_matches(['-', '/', '.', ' ', ','])
}

/// Reads a number or the name of a month, with the number of digits.
fn part(text: &str) -> Option<((i64, usize), &str)> {
    if let Some((number, count, rest)) = digits(text, 4) {
        return Some(((number, count), rest));
    }
    let end = text.find(|c: char| !c.is_alphabetic()).unwrap_or(text.len());
    Some(((month(&text[..end])?, 0), &text[end..]))
}

/// Reads an elapsed time in minutes and seconds, such as `75:30.5`.
fn elapsed(text: &str) -> Option<Stamp> {
    /// Digits of the minutes: a year has six.
    const MOST: usize = 7;
    let text = text.trim().trim_matches('"').trim();
    let (minutes, _, rest) = digits(text, MOST)?;
    let (seconds, width, rest) = digits(rest.strip_prefix(':')?, 2)?;
    let (fraction, rest) = fraction(rest)?;
    let time = Time { nanoseconds: (minutes * 60 + seconds) * SECOND + fraction, clock: ClockFormat::MinutesSeconds };
    let is_time = width == 2 && seconds < 60 && rest.is_empty();
    is_time.then_some(Stamp { date: None, time: Some(time), zone: None })
}

/// Reads decimals of a second, ns; there may be none.
fn fraction(text: &str) -> Option<(i64, &str)> {
    let Some(after) = text.strip_prefix(['.', ',']) else { return Some((0, text)) };
    let count = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
    // Digits beyond ns are dropped.
    let shown = &after[..count.min(9)];
    let scale = 10_i64.pow(9 - u32::try_from(shown.len()).expect("at most 9"));
    Some((shown.parse::<i64>().ok()? * scale, &after[count..]))
}

/// Reads a time of day with minutes.
fn time_of_day(text: &str) -> Option<(Time, &str)> {
    let (hour, _, rest) = digits(text, 2)?;
    let (minute, width, mut rest) = digits(rest.strip_prefix(':')?, 2)?;
    let (mut second, mut part, mut clock) = (0, 0, ClockFormat::HoursMinutes);
    if width != 2 || minute > 59 {
        return None;
    }
    if let Some(after) = rest.strip_prefix(':') {
        let (value, width, after) = digits(after, 2)?;
        // 60 is a leap second.
        if width != 2 || value > 60 {
            return None;
        }
        (second, clock) = (value, ClockFormat::HoursMinutesSeconds);
        (part, rest) = fraction(after)?;
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
    let nanoseconds = ((hour * 60 + minute) * 60 + second) * SECOND + part;
    (hour < 24).then_some((Time { nanoseconds, clock }, rest))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[allow(clippy::cast_precision_loss)]
    fn seconds(text: &str) -> Option<f64> {
        let column = column([Some(text)].into_iter(), None)?.ok()?;
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
            ("17.05.24", 1_715_904_000.0),
            ("17.05.68", 3_104_438_400.0),
            ("1.1.69 00:00", -31_536_000e9 * 1e-9),
            ("5/17/24 12:00 AM", 1_715_904_000.0),
            ("17-May-2024", 1_715_904_000.0),
            ("17-MAY-24 00:00:01", 1_715_904_001.0),
            ("17. Mai 2024 00:00", 1_715_904_000.0),
            ("May 17, 2024 00:00:01", 1_715_904_001.0),
            ("17 d\u{e9}c. 2024", 1_734_393_600.0),
            ("2024-M\u{e4}r-01", 1_709_251_200.0),
            ("17MAY2024", 1_715_904_000.0),
            ("20240517T000001.5", 1_715_904_001.5),
            ("20240517 0001", 1_715_904_060.0),
            ("20240517000001", 1_715_904_001.0),
            ("20240517T020000+0200", 1_715_904_000.0),
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
            "10:30.5",
            "10:30:00Z",
            "17-Mxe-2024",
            "17-Jui-2024",
            "31-Apr-2024",
            "20240230T103000",
            "2024051710300",
            "24.05",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }

    fn read(cells: &[&str]) -> Result<Column, String> {
        column(cells.iter().map(|cell| (!cell.is_empty()).then_some(*cell)), None).expect("they are stamps")
    }

    #[test]
    fn one_date_decides_the_order_of_day_and_month_of_all() {
        let day = |cells: &[&str]| read(cells).unwrap().nanoseconds[0].unwrap() / DAY;
        assert_eq!(day(&["01/02/2024", "13/02/2024"]), day(&["2024-02-01"]));
        assert_eq!(day(&["01/02/2024", "01/13/2024"]), day(&["2024-01-02"]));
        assert_eq!(day(&["05/05/2024"]), day(&["2024-05-05"]));
        assert!(read(&["05/01/2024 11:50:00 AM", "05/02/2024 11:50:00 AM"]).unwrap_err().contains("day/month"));
        assert!(column([Some("13/02/2024"), Some("02/13/2024")].into_iter(), None).is_none());
    }

    #[test]
    fn years_of_two_digits_are_read_if_the_column_shows_their_place() {
        let days = |cells: &[&str]| {
            let column = read(cells).unwrap_or_else(|why| panic!("{why}"));
            column.nanoseconds.iter().map(|ns| ns.unwrap() / DAY).collect::<Vec<_>>()
        };
        for cells in
            [["24-05-13", "24-05-14"], ["13-05-24", "14-05-24"], ["13/05/24", "14/05/24"], ["13.05.24", "14.05.24"]]
        {
            assert_eq!(days(&cells), days(&["2024-05-13", "2024-05-14"]), "{cells:?}");
        }
        assert!(read(&["13-05-24", "13-05-24"]).unwrap_err().contains("may be day/month or year/month/day"));
        assert!(read(&["05/06/24", "05/07/24"]).unwrap_err().contains("may be day/month or month/day"));
        // A number that counts up beside a constant day and month is no year.
        for cells in [["24.05.13", "24.05.14"], ["24/05/13", "24/05/14"]] {
            assert!(column(cells.map(Some).into_iter(), None).is_none(), "{cells:?}");
        }
    }

    #[test]
    fn the_header_gives_the_form_of_the_cells() {
        let seconds = |cell: &str, unit: &str| {
            let column = column([Some(cell)].into_iter(), Some(unit)).expect("the cells are stamps")?;
            #[allow(clippy::cast_precision_loss)]
            Ok::<_, String>((column.nanoseconds[0].unwrap() as f64 * 1e-9, column.reference))
        };
        for unit in ["mm:ss", "min:sec", "MM:SS", "m:s", "min:s", "Min:Sek", "mm:ss.000", "mm:ss,fff"] {
            assert_eq!(seconds("75:30.5", unit), Ok((4530.5, None)), "{unit}");
        }
        for unit in ["hh:mm", "h:min", "HH:MM", "Std:Min"] {
            assert_eq!(seconds("01:30", unit), Ok((5400.0, Some(Reference::Midnight))), "{unit}");
        }
        for unit in ["hh:mm:ss", "H:M:S"] {
            assert_eq!(seconds("01:30:01 AM", unit), Ok((5401.0, Some(Reference::Midnight))), "{unit}");
        }
        for (cell, unit, day) in [
            ("05/06/2024", "dd/mm/yyyy", "2024-06-05"),
            ("05/06/2024", "MM/DD/YYYY", "2024-05-06"),
            ("05.06.24", "TT.MM.JJ", "2024-06-05"),
            ("05.06.24", "yy.mm.dd", "2005-06-24"),
            ("05.06.24 00:00", "yy.mm.dd hh:mm", "2005-06-24"),
            ("05-06-24 00:00", "dd-mm-yy", "2024-06-05"),
        ] {
            let expected = read(&[day]).unwrap().nanoseconds[0].unwrap();
            #[allow(clippy::cast_precision_loss)]
            let expected = expected as f64 * 1e-9;
            assert_eq!(seconds(cell, unit), Ok((expected, Some(Reference::Local))), "{cell} {unit}");
        }
        for (cell, unit) in [
            ("12:30", "ms"),
            ("12:30", "s"),
            ("12:30:00", "s"),
            ("12:30", "V"),
            ("12:30", "hh:mm:ss"),
            ("12:30:00", "hh:mm"),
            ("1:12:30", "mm:ss"),
            ("12:30 PM", "mm:ss"),
            ("12:30", "ss:ms"),
            ("2024-05-06", "dd.mm.yyyy"),
            ("2024-05-06", "mm:ss"),
            ("12:30", "dd.mm.yyyy"),
        ] {
            let why = seconds(cell, unit).unwrap_err();
            assert!(why.contains(&format!("`{cell}` contradicts `{unit}`")), "{why}");
        }
        // A zone or a word is no unit.
        assert!(seconds("12:30", "UTC").is_ok() && seconds("12:30", "local").is_ok());
    }

    #[test]
    fn texts_that_are_meant_as_dates_are_known() {
        for text in [
            "31.02.24",
            "2024-13-05",
            "13/05",
            "13.05.",
            "Mon 13.05.24",
            "13. Mai",
            "Fr 13 May 2024",
            "13.05.'24",
            "2024\u{5e74}5\u{6708}13\u{65e5}",
            "\"13.05.2024\"",
            "May 3",
        ] {
            assert!(is_like_date(text), "{text}");
        }
        for text in
            ["", "start", "1.2.3", "12:30", "25:10:00", "5,3", "10.0.0.1", "rig 2", "ABC-2024-1", "-", "40/99", "May"]
        {
            assert!(!is_like_date(text), "{text}");
        }
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
