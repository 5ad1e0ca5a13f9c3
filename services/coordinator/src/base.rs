//! The address under which a client sees the service.

/// What stands before all addresses that an answer names: the service as the client sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Base {
    pub(crate) scheme: &'static str,
    pub(crate) host: String,
    /// What a proxy takes from the front of addresses; empty, or a path that begins with `/` and does not end with it.
    pub(crate) prefix: String,
}

impl Base {
    /// The service at an address that was kept as text.
    pub(crate) fn kept(text: &str) -> Self {
        let (scheme, rest) = text.split_once("://").unwrap_or(("http", text));
        let (host, prefix) = rest.find('/').map_or((rest, ""), |at| rest.split_at(at));
        let scheme = if scheme == "https" { "https" } else { "http" };
        Self { scheme, host: host.to_owned(), prefix: prefix.to_owned() }
    }

    /// An address of the service.
    pub(crate) fn href(&self, path: &str) -> String {
        format!("{}://{}{}{path}", self.scheme, self.host, self.prefix)
    }

    /// The service as browsers name it in the header `Origin`.
    pub(crate) fn origin(&self) -> String {
        format!("{}://{}", self.scheme, self.host)
    }

    /// Whether what is said to the service is said in secret, as the client sees it.
    pub(crate) fn is_secret(&self) -> bool {
        self.scheme == "https"
    }

    /// What stands before all paths.
    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }
}
