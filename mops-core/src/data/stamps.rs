//! Time stamps: `2024-05-17T10:30:00.5+02:00`, `2024-05-17 10:30:00`, `2024-05-17` and `10:30:00.5`.

use toml::value::{Date, Datetime, Offset, Time};

/// Nanoseconds in a second.
const SECOND: i64 = 1_000_000_000;

/// Returns a time stamp in ns since 1970, and since midnight if it has no date; `None` for other text.
///
/// Without an offset the time counts as universal time. Source of the format: ISO 8601 as restricted by RFC 3339.
pub(super) fn nanoseconds(text: &str) -> Option<i64> {
    let text = text.trim().trim_matches('"').trim();
    let Datetime { date, time, offset } = text.parse().ok()?;
    let days = date.map_or(0, days);
    let within = time.map_or(0, |Time { hour, minute, second, nanosecond, .. }| {
        let seconds = (i64::from(hour) * 60 + i64::from(minute)) * 60 + i64::from(second.unwrap_or(0));
        seconds * SECOND + i64::from(nanosecond.unwrap_or(0))
    });
    let east = match offset {
        Some(Offset::Custom { minutes }) => i64::from(minutes) * 60 * SECOND,
        _ => 0,
    };
    days.checked_mul(86_400 * SECOND)?.checked_add(within - east)
}

/// Returns the days since 1970-01-01 in the Gregorian calendar.
///
/// Source: E. G. Richards, Calendars, in: Explanatory Supplement to the Astronomical Almanac, 3rd edition (2013), section 15.11.3.
fn days(Date { year, month, day }: Date) -> i64 {
    let (year, month, day) = (i64::from(year), i64::from(month), i64::from(day));
    // Years that begin in March, so that a leap day is the last day of one.
    let (year, month) = if month <= 2 { (year - 1, month + 9) } else { (year, month - 3) };
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + (153 * month + 2) / 5 + day
        - 719_469
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_count_from_1970_and_stand_for_one_instant_in_all_forms() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2000-03-01 00:00:00", 951_868_800.0),
            ("2024-02-29T23:59:59.25", 1_709_251_199.25),
            ("2024-02-29T23:59:59.25+01:30", 1_709_245_799.25),
            ("\"1969-12-31 23:00:00\"", -3600.0),
            ("2024-05-17", 1_715_904_000.0),
            ("10:30:00.5", 37_800.5),
        ] {
            #[allow(clippy::cast_precision_loss)]
            let found = nanoseconds(text).map(|ns| ns as f64 * 1e-9);
            assert_eq!(found, Some(seconds), "{text}");
        }
        for text in ["", "noon", "2024-13-01 00:00:00", "1.5", "17.05.2024"] {
            assert_eq!(nanoseconds(text), None, "{text}");
        }
    }
}
