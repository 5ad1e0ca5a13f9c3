-- Who is told of what happens, and what is still to be told.

CREATE TABLE webhook (
    id      TEXT   NOT NULL PRIMARY KEY,
    owner   TEXT   NOT NULL,
    url     TEXT   NOT NULL,
    -- Signs the messages, so it is needed as it is.
    secret  TEXT   NOT NULL,
    -- Kinds of events, each with a comma behind it; empty for all.
    events  TEXT   NOT NULL,
    -- Only of this city.
    city    TEXT,
    -- 0 after its receiver has said that it is gone for good.
    enabled BIGINT NOT NULL,
    created BIGINT NOT NULL
);

-- Written in the transaction of what they tell of, so that none is lost and none is made up.
CREATE TABLE webhook_message (
    id       TEXT   NOT NULL PRIMARY KEY,
    webhook  TEXT   NOT NULL REFERENCES webhook (id) ON DELETE CASCADE,
    event    TEXT   NOT NULL,
    -- JSON.
    data     TEXT   NOT NULL,
    -- waiting, delivered or failed.
    state    TEXT   NOT NULL,
    attempts BIGINT NOT NULL,
    -- When it is to be sent, or sent again if its sender says no more.
    next     BIGINT NOT NULL,
    -- What the last attempt came to.
    answer   TEXT,
    created  BIGINT NOT NULL,
    finished BIGINT
);

CREATE INDEX webhook_message_by_time ON webhook_message (state, next);
CREATE INDEX webhook_message_by_webhook ON webhook_message (webhook, id);
