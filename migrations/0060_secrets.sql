-- What the service signs with. Made once, known to all coordinators of the database, and to nobody else.
CREATE TABLE secret (
    name  TEXT   NOT NULL PRIMARY KEY,
    value TEXT   NOT NULL,
    made  BIGINT NOT NULL
);
