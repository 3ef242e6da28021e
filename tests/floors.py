"""Where each module of the smaller folders stands: each may import what stands in a row below it.

The wide floors are in ``test_architecture``, which also tells what the rows mean.
"""

FLOORS_WITHIN = {
    "analysis/dumps": [
        {"other_formats"},
        {"other_trajectories", "universe"},
        {"contact_detection", "dump"},
        {"binary", "collision_frames", "contact_times", "masses", "timestep"},
        {"chain_frames", "text", "view"},
        {"data_file", "frame", "printed"},
    ],
    "analysis/figures": [
        {
            *("agreement", "animation", "bond_lengths", "contact_intervals", "energy_partition"),
            *("mode_heat_map", "script_ladder", "spectrum", "store_plots", "terminal"),
            *("trajectories", "work_precision"),
        },
        {"style"},
        {"offset_in_label", "places"},
    ],
    "analysis/ladders": [
        {"verdict"},
        {"means", "order_fit", "series"},
    ],
    "analysis/showing": [
        {"notebook", "numbers"},
    ],
    "analysis/slow_chains": [
        {"curve", "front", "harmonic"},
    ],
    "benchmarks": [
        {"bars", "certified", "extremes"},
        {"__main__", "judge", "slow_chains"},
        {
            *("blind_settings", "blind_steps", "convergence_plot", "jobs", "long_chains"),
            *(
                "only_required",
                "peers",
                "public_scripts",
                "scenes",
                "schemes",
                "script_advice",
                "sweeps",
            ),
            *("table_rows", "timestep_table", "two_bodies", "warm", "warm_draws"),
        },
    ],
    "benchmarks/bars": [
        {"calibrate"},
        {"honest", "scheme_costs", "step_samples"},
        {"analyzed", "formula_scenes", "ladders", "samples", "user_scenes"},
    ],
    "benchmarks/certified": [
        {"__main__"},
        {"collision", "table"},
        {"contacts"},
        {"flow"},
        {"bonds"},
    ],
    "benchmarks/extremes": [
        {"map"},
        {"picture"},
        {"verdicts"},
        {"cases", "cells", "fuzz_inputs", "mass_ratios"},
    ],
    "benchmarks/judge": [
        {"end_counterexamples", "late_contacts"},
        {"judge", "lines", "parting_counterexamples"},
        {"bodies", "collocation", "laws"},
        {"bodies_steps", "kinks", "plain", "steps"},
    ],
    "benchmarks/peers": [
        {"batches"},
        {"in_house_engine"},
        {"c_loops", "lammps_engine"},
        {"equal_time", "event_overhead", "integrators", "ranks"},
    ],
    "benchmarks/scenes": [
        {"lines", "warm"},
        {"chains", "company", "late"},
    ],
    "benchmarks/schemes": [
        {"evaluations"},
        {"candidates"},
        {"nystrom"},
    ],
    "benchmarks/slow_chains": [
        {"picture"},
        {"curves", "ending", "harmonic_limit", "lattices"},
    ],
    "benchmarks/sweeps": [
        {"forecasts", "kills", "overhead", "throughput"},
    ],
    "benchmarks/warm": [
        {"detailed_balance", "gain", "throughput"},
    ],
    "lammps_inputs": [
        {"plain_script"},
        {"script"},
        {"contact_script"},
        {"chain_data", "numerics"},
        {"bond_table", "scene"},
        {"scene_parts"},
        {"line", "thermal_state"},
        {"bonds", "given_numbers", "initial_state", "own_templates", "units"},
        {"errors", "explain", "number_types", "small_file"},
    ],
    "lammps_inputs/own_templates": [
        {"own_template"},
        {"rules"},
    ],
    "lammps_inputs/scene_parts": [
        {"field_types", "identity", "scene_file"},
        {"given_bodies", "rules"},
    ],
    "lammps_inputs/units": [
        {"unit_system"},
    ],
    "workflows/accuracy": [
        {"at_once"},
        {"expected_cost", "meet", "table_rows"},
        {"by_in_house"},
        {"by_lammps", "fixed_steps"},
        {"regular", "scouting", "step_search"},
        {"convergence"},
        {"answer", "irregular"},
        {"calibrate", "error_bars"},
        {"cost_model", "in_house_runs", "step_guess"},
    ],
    "workflows/accuracy/at_once": [
        {"many", "together"},
    ],
    "workflows/campaign": [
        {"ensemble_text", "sweep"},
        {"sweep_file"},
        {"collide_many"},
        {"ensemble", "forecast", "into_store", "points", "warm"},
        {"work"},
        {"carry_out"},
        {"cluster", "pool", "progress"},
    ],
    "workflows/commands": [
        {"analyze", "inputs", "run", "tradeoff", "validate"},
        {
            *("table", "timestep"),
            *("collect", "doctor", "explain", "explore", "lessons", "plot", "reproduce"),
            *("scene_options", "show", "store", "sweep"),
        },
    ],
    "workflows/engines/in_house/blocks": [
        {"running"},
        {"loop"},
    ],
    "workflows/engines/in_house/lines": [
        {"ensemble"},
        {"compiled"},
        {"ensemble_loop", "modal"},
        {"modal_bodies"},
        {"body_modes", "lanes", "many_states", "modal_loop"},
    ],
    "workflows/engines/in_house/loops": [
        {"kept_loops"},
        {"beside"},
        {"adaptive_loops", "adaptive_rates", "code_prints", "cores", "mode_loops"},
    ],
    "workflows/engines/in_house/side_by_side": [
        {"runs"},
        {"compiled"},
        {"loop"},
        {"trips"},
        {"coasts", "hunts", "lanes"},
    ],
    "workflows/engines/lammps": [
        {"engine"},
        {"kept_script"},
        {"course"},
        {"certificate", "flight"},
        {"instance"},
        {"blind", "bodies", "crossing", "far_bonds", "guard", "library", "meeting", "whole_steps"},
    ],
    "workflows/grids": [
        {"collect"},
        {"grid"},
        {"submit"},
    ],
    "workflows/job_analysis": [
        {"page"},
        {"analyze", "description"},
    ],
    "workflows/lessons": [
        {"check", "exercises"},
        {"begin", "exercise", "notebooks", "pages"},
    ],
    "workflows/lessons/exercises": [
        {"lesson_1", "lesson_4", "lesson_5", "lesson_6", "lesson_7", "lesson_8"},
        {"in_house", "lesson_2", "lesson_3"},
    ],
    "workflows/pages": [
        {"page"},
        {"typesetting"},
    ],
    "workflows/pictures": [
        {"watch"},
        {"live_page", "recording"},
        {"bond_script"},
    ],
    "workflows/reproduce/figures": [
        {"contacts_and_restitution", "slope"},
        {"increase", "restitution_curves"},
        {
            *("agreement", "breaking_and_two_restitutions", "harmonic_contacts"),
            *("harmonic_lengths", "lj_lengths", "mode_spectra", "pair", "schematic"),
            "trajectories",
        },
    ],
    "workflows/scripted": [
        {"plan"},
    ],
    "workflows/scripts": [
        {"report"},
        {"page"},
        {"study"},
        {"parting"},
        {"ladder_runs"},
        {"advice", "script_run"},
        {"ladder", "observable", "quantities", "rewriting"},
        {"step_counts"},
        {"script_text"},
    ],
    "workflows/showing": [
        {"shown"},
        {"table"},
        {"plots", "text"},
        {"described", "terms"},
    ],
    "workflows/store": [
        {"export"},
        {"merge", "query"},
        {"results_store"},
        {"row"},
        {"connection"},
        {"schema", "standing"},
    ],
    "workflows/tables": [
        {"rewrite"},
        {"check"},
    ],
    "workflows/tradeoff": [
        {"study_files"},
        {"description", "page"},
        {"study"},
        {"front"},
        {"bond_tables", "budget", "measurement"},
        {"oracles", "settings", "truth"},
    ],
    "workflows/validation": [
        {"user_ladder"},
        {"drawing", "lammps_result", "user_comparison"},
        {"comparison"},
        {"grid", "user_integrator"},
    ],
}
# Modules that name a class of a row above them for the type checker alone.
NAMED_FOR_TYPES = {
    "lammps_inputs": "chaincor.lammps_inputs.scene.Scene",
    "workflows/engines/lammps": "chaincor.workflows.engines.lammps.instance.LammpsChain",
    "workflows/store": "chaincor.workflows.store.results_store.Store",
}
