//! When a schedule ticks: a cron expression in a time zone.
//!
//! A time of day that the clocks skip in spring has its tick when they have been put forward, and one that comes twice in autumn ticks
//! once, at the first: unless the expression is about every hour, minute or second, which follow the time that passes.

use croner::errors::CronError;
use croner::{CivilDate, CivilDateTime, CivilTime, Cron, CronDateTime, Resolution, Weekday};
use jiff::tz::{AmbiguousOffset, TimeZone};
use jiff::{SignedDuration, Timestamp, ZonedDateTime};
use std::cmp::Ordering;

/// Why an expression or a time zone is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CronRefused {
    /// Not a cron expression.
    #[error("cron {0:?}: {1}; give minute, hour, day, month and weekday, such as \"30 2 * * MON\"")]
    Expression(String, String),
    /// Not a time zone.
    #[error("zone {0:?} is no time zone: give a name of the IANA database, such as Europe/Amsterdam")]
    Zone(String),
    /// An expression that no time fulfils.
    #[error("cron {0:?} never comes true")]
    Never(String),
}

/// When to tick.
#[derive(Clone, Debug)]
pub(crate) struct Ticks {
    text: String,
    cron: Cron,
    zone: TimeZone,
}

impl Ticks {
    /// The ticks of an expression in the time zone of this name.
    ///
    /// # Errors
    /// If either cannot be read.
    pub(crate) fn new(cron: &str, zone: &str) -> Result<Self, CronRefused> {
        let refused =
            |e: CronError| CronRefused::Expression(cron.to_owned(), e.to_string().trim_end_matches('.').to_owned());
        let read = cron.parse().map_err(refused)?;
        let zone = TimeZone::get(zone).map_err(|_| CronRefused::Zone(zone.to_owned()))?;
        Ok(Self { text: cron.to_owned(), cron: read, zone })
    }

    /// The first tick after a time; both milliseconds since 1970.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn after(&self, time: i64) -> Result<i64, CronRefused> {
        let never = || CronRefused::Never(self.text.clone());
        let time = Timestamp::from_millisecond(time).map_err(|_| never())?;
        let next = self.cron.find_next_occurrence(&Moment(time.to_zoned_datetime(self.zone.clone())), false);
        next.map(|m| m.0.timestamp().as_millisecond()).map_err(|_| never())
    }
}

/// A time as the library of cron expressions wants it.
#[derive(Clone)]
struct Moment(ZonedDateTime);

impl CronDateTime for Moment {
    fn to_civil(&self) -> CivilDateTime {
        let part = |n: i8| u32::from(n.unsigned_abs());
        let date = CivilDate::from_parts_unchecked(self.0.year().into(), part(self.0.month()), part(self.0.day()));
        let time = CivilTime::from_parts_unchecked(part(self.0.hour()), part(self.0.minute()), part(self.0.second()));
        CivilDateTime::new(date, time)
    }

    fn civil_weekday(&self) -> Weekday {
        Weekday::from_days_from_sunday(u32::from(self.0.weekday().to_sunday_zero_offset().unsigned_abs()))
    }

    fn resolve_civil(&self, civil: CivilDateTime) -> Result<Resolution<Self>, CronError> {
        let part = |n: u32| i8::try_from(n).map_err(|_| CronError::InvalidTime);
        let year = i16::try_from(civil.year()).map_err(|_| CronError::InvalidDate)?;
        let time = jiff::civil::DateTime::new(
            year,
            part(civil.month())?,
            part(civil.day())?,
            part(civil.hour())?,
            part(civil.minute())?,
            part(civil.second())?,
            0,
        );
        let found = self.0.time_zone().to_ambiguous_zoned_datetime(time.map_err(|_| CronError::InvalidDate)?);
        let moment = |zoned: Result<ZonedDateTime, jiff::Error>| zoned.map(Self).map_err(|_| CronError::InvalidTime);
        Ok(match found.offset() {
            AmbiguousOffset::Unambiguous { .. } => Resolution::Single(moment(found.unambiguous())?),
            AmbiguousOffset::Fold { .. } => {
                Resolution::Ambiguous(moment(found.clone().earlier())?, moment(found.later())?)
            }
            AmbiguousOffset::Gap { .. } => Resolution::Gap,
        })
    }

    fn checked_add_seconds(&self, seconds: i64) -> Option<Self> {
        self.0.checked_add(SignedDuration::from_secs(seconds)).ok().map(Self)
    }

    fn cmp_instant(&self, other: &Self) -> Ordering {
        self.0.timestamp().cmp(&other.0.timestamp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(cron: &str, zone: &str, from: &str, number: usize) -> Vec<String> {
        let ticks = Ticks::new(cron, zone).expect("they are read");
        let mut time = from.parse::<Timestamp>().expect("a time").as_millisecond();
        let mut all = Vec::new();
        for _ in 0..number {
            time = ticks.after(time).expect("a tick");
            all.push(Timestamp::from_millisecond(time).expect("a time").to_string());
        }
        all
    }

    #[test]
    fn ticks_follow_the_clock_of_their_zone() {
        assert_eq!(
            ticks("30 2 * * MON", "Asia/Tokyo", "2026-06-01T00:00:00Z", 2),
            ["2026-06-07T17:30:00Z", "2026-06-14T17:30:00Z"]
        );
        assert_eq!(ticks("0 12 29 2 *", "UTC", "2026-06-01T00:00:00Z", 1), ["2028-02-29T12:00:00Z"]);
        assert_eq!(
            ticks("*/20 * * * * *", "UTC", "2026-06-01T00:00:10Z", 2),
            ["2026-06-01T00:00:20Z", "2026-06-01T00:00:40Z"]
        );
        let exactly = ticks("0 * * * *", "UTC", "2026-06-01T01:00:00Z", 1);
        assert_eq!(exactly, ["2026-06-01T02:00:00Z"], "a tick is not its own successor");
    }

    #[test]
    fn each_day_has_one_tick_also_when_clocks_change() {
        // In Amsterdam, clocks go from 2 to 3 on 28 March 2027, and from 3 to 2 on 31 October.
        let spring = ticks("30 2 * * *", "Europe/Amsterdam", "2027-03-27T00:00:00Z", 3);
        assert_eq!(spring, ["2027-03-27T01:30:00Z", "2027-03-28T01:00:00Z", "2027-03-29T00:30:00Z"]);
        let autumn = ticks("30 2 * * *", "Europe/Amsterdam", "2027-10-30T00:00:00Z", 3);
        assert_eq!(autumn, ["2027-10-30T00:30:00Z", "2027-10-31T00:30:00Z", "2027-11-01T01:30:00Z"]);
        let hourly = ticks("0 * * * *", "Europe/Amsterdam", "2027-10-30T23:30:00Z", 3);
        assert_eq!(hourly, ["2027-10-31T00:00:00Z", "2027-10-31T01:00:00Z", "2027-10-31T02:00:00Z"]);
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (cron, zone, said) in [
            ("61 * * * *", "UTC", "minute, hour, day, month and weekday"),
            ("never", "UTC", "minute, hour, day, month and weekday"),
            ("", "UTC", "minute, hour, day, month and weekday"),
            ("0 0 * * *", "Europe/Atlantis", "Europe/Amsterdam"),
            ("0 0 * * *", "../../etc/passwd", "Europe/Amsterdam"),
        ] {
            let told = Ticks::new(cron, zone).expect_err(cron).to_string();
            assert!(told.contains(said), "{told}");
        }
        let never = Ticks::new("0 0 30 2 *", "UTC").and_then(|t| t.after(0));
        assert_eq!(never, Err(CronRefused::Never("0 0 30 2 *".to_owned())));
    }
}
