-- People who have signed in at the dashboard. Of what their browser shows only a hash is kept: it is 256 random bits.

CREATE TABLE session (
    hash      TEXT   NOT NULL PRIMARY KEY,
    -- user:NAME, which no token has.
    name      TEXT   NOT NULL,
    scope     TEXT   NOT NULL,
    -- Groups, each with a comma behind it.
    in_groups TEXT   NOT NULL,
    created   BIGINT NOT NULL,
    expires   BIGINT NOT NULL
);

CREATE INDEX session_by_name ON session (name, expires);
