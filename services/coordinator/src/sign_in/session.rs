//! The cookies of browsers, and the guard of requests that show one.
//!
//! A browser sends cookies by itself, whichever page makes it ask. `SameSite=Lax` keeps them from the requests of pages of other sites,
//! but for links that people follow; a write that shows a session has to come from a page of this service besides, as the browser says by
//! `Sec-Fetch-Site`, or an older one by `Origin`.

use crate::Problem;
use crate::base::Base;
use crate::cors::checked_origin;
use axum::http::{HeaderMap, header};
use std::time::Duration;

/// Name of the cookie of a session, and of that of somebody who is about to sign in.
pub(crate) const SESSION: &str = "gable-session";
pub(super) const LOGIN: &str = "gable-login";

/// What a browser shows in the cookie of this name, which has the name that it is given under this address.
pub(crate) fn shown<'a>(headers: &'a HeaderMap, base: &Base, name: &str) -> Option<&'a str> {
    let name = named(base, name);
    let all = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok()).flat_map(|v| v.split(';'));
    let mut same = all.filter_map(|pair| pair.trim().split_once('=')).filter(|(known, _)| *known == name);
    same.next().map(|(_, value)| value).filter(|value| !value.is_empty())
}

/// The name of a cookie. Over https the prefix keeps other hosts of the domain from setting it.
fn named(base: &Base, name: &str) -> String {
    if base.is_secret() { format!("__Host-{name}") } else { name.to_owned() }
}

/// The header that gives a browser a cookie for a time, which scripts cannot read; none takes it away.
pub(super) fn given(base: &Base, name: &str, value: Option<(&str, Duration)>) -> String {
    let secure = if base.is_secret() { "; Secure" } else { "" };
    let (value, seconds) = value.map_or(("", 0), |(value, time)| (value, time.as_secs()));
    format!("{}={value}; Path=/; Max-Age={seconds}; HttpOnly; SameSite=Lax{secure}", named(base, name))
}

/// An error unless a browser says that a page of this service has made it ask.
pub(crate) fn from_own_page(headers: &HeaderMap, base: &Base) -> Result<(), Problem> {
    let text = |name: &str| headers.get(name).and_then(|v| v.to_str().ok());
    let own = match text("sec-fetch-site") {
        Some(site) => site == "same-origin",
        None => text(header::ORIGIN.as_str()).is_some_and(|origin| is_origin(origin, &base.origin())),
    };
    if own {
        return Ok(());
    }
    let detail =
        "who has signed in changes things from the dashboard only: a program shows a token (gable token create)";
    Err(Problem::forbidden(detail))
}

/// Whether a text is what browsers send as the origin of the pages of a service.
fn is_origin(text: &str, base: &str) -> bool {
    checked_origin(text).is_ok() && text.eq_ignore_ascii_case(base)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn headers(list: &[(&'static str, &'static str)]) -> HeaderMap {
        list.iter().map(|(name, value)| ((*name).parse().unwrap(), HeaderValue::from_static(value))).collect()
    }

    #[test]
    fn writes_come_from_pages_of_this_service() {
        let base = Base::kept("https://city.example/gable");
        let asked = |list: &[(&'static str, &'static str)]| from_own_page(&headers(list), &base).is_ok();
        assert!(asked(&[("sec-fetch-site", "same-origin")]));
        assert!(asked(&[("origin", "https://city.example")]));
        for site in ["same-site", "cross-site", "none", ""] {
            // Which the browser says counts, whatever the page says.
            let forged = [("sec-fetch-site", site), ("origin", "https://city.example")];
            assert!(!asked(&forged), "{site}");
        }
        for origin in [
            "https://evil.example",
            "http://city.example",
            "null",
            "https://city.example:8443",
            "https://city.example/gable",
        ] {
            assert!(!asked(&[("origin", origin)]), "{origin}");
        }
        assert!(!asked(&[]), "a browser says one of them");
    }

    #[test]
    fn cookies_are_for_one_host_and_no_script() {
        let (open, secret) = (Base::kept("http://localhost:8080"), Base::kept("https://city.example/gable"));
        let hour = Duration::from_secs(3600);
        assert_eq!(
            given(&open, SESSION, Some(("a", hour))),
            "gable-session=a; Path=/; Max-Age=3600; HttpOnly; SameSite=Lax"
        );
        assert_eq!(
            given(&secret, SESSION, None),
            "__Host-gable-session=; Path=/; Max-Age=0; HttpOnly; SameSite=Lax; Secure"
        );
        let sent = headers(&[("cookie", "a=b; __Host-gable-session=x;gable-session=y"), ("cookie", "gable-login=z")]);
        assert_eq!((shown(&sent, &open, SESSION), shown(&sent, &secret, SESSION)), (Some("y"), Some("x")));
        assert_eq!((shown(&sent, &open, LOGIN), shown(&sent, &secret, LOGIN)), (Some("z"), None));
    }
}
