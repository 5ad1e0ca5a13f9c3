-- The version of the program whose workers do a job's tasks; NULL before the first of them, and for jobs of earlier versions, which
-- whoever takes their next task goes on with.
ALTER TABLE job ADD COLUMN program TEXT;
