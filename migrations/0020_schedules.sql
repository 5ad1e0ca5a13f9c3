-- Jobs that are submitted again and again, by the clock.

CREATE TABLE schedule (
    name     TEXT   NOT NULL PRIMARY KEY,
    owner    TEXT   NOT NULL,
    city     TEXT   NOT NULL,
    -- What each job is to do, JSON.
    request  TEXT   NOT NULL,
    priority BIGINT NOT NULL,
    cron     TEXT   NOT NULL,
    -- Name of a time zone in the IANA database.
    zone     TEXT   NOT NULL,
    -- What becomes of a tick at which no coordinator was there: skip or once.
    missed   TEXT   NOT NULL,
    enabled  BIGINT NOT NULL,
    -- The next tick; NULL if none will come. Whoever moves it on from a tick has won that tick.
    next     BIGINT,
    -- Number of the last run.
    runs     BIGINT NOT NULL,
    -- The job of the last run that had one.
    job      TEXT,
    created  BIGINT NOT NULL
);

CREATE INDEX schedule_by_tick ON schedule (enabled, next);

CREATE TABLE schedule_run (
    schedule TEXT   NOT NULL REFERENCES schedule (name) ON DELETE CASCADE,
    number   BIGINT NOT NULL,
    -- The tick; for a run by hand, when it was asked for.
    due      BIGINT NOT NULL,
    at       BIGINT NOT NULL,
    -- submitted, overlap or missed.
    outcome  TEXT   NOT NULL,
    job      TEXT,
    PRIMARY KEY (schedule, number)
);
