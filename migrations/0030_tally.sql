-- What became of all attempts at tasks so far, for monitoring: counted where they end, so that nobody has to read all tasks.

CREATE TABLE tally (
    stage   BIGINT NOT NULL,
    -- done, reused, retried, failed, lost or handed-back.
    outcome TEXT   NOT NULL,
    tasks   BIGINT NOT NULL,
    seconds DOUBLE PRECISION NOT NULL,
    -- Of what was made.
    bytes   BIGINT NOT NULL,
    PRIMARY KEY (stage, outcome)
);
