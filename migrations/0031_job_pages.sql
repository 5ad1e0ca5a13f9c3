-- Pages of jobs go by id, newest first, within a state, a city or an owner: each page is a walk along one of these, however many
-- jobs there are.

CREATE INDEX job_page_by_state ON job (state, id);
CREATE INDEX job_page_by_city ON job (city, id);
CREATE INDEX job_page_by_owner ON job (owner, id);
DROP INDEX job_by_city;
DROP INDEX job_by_creation;
