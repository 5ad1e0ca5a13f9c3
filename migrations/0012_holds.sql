-- Blobs that someone is about to refer to, so that they are not collected, and those that are being collected.

CREATE TABLE blob_hold (
    blob   TEXT   NOT NULL PRIMARY KEY,
    -- Until when it is held, milliseconds since 1970.
    until  BIGINT NOT NULL,
    -- 1 from when its removal was decided until it is gone: nobody may refer to it.
    doomed BIGINT NOT NULL
);
