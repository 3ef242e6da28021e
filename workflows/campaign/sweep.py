"""Run sweeps from Python, with axes over fields of a scene, and return a data frame."""

import tempfile
from collections.abc import Iterable
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chaincor.lammps_inputs.given_numbers import shown
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.into_store import open_store, store_missing
from chaincor.workflows.campaign.points import (
    SweepPoints,
    fields_set,
    refuse_shared_fields,
    scenes_of,
    value_of,
)
from chaincor.workflows.campaign.sweep_file import read_axes
from chaincor.workflows.errors import SweepError
from chaincor.workflows.given import scene_given, with_short_errors, workers_given
from chaincor.workflows.store.export import require_pandas, to_pandas
from chaincor.workflows.store.results_store import Store

if TYPE_CHECKING:
    import pandas
    from distributed import Client


@with_short_errors
def sweep(
    scene: Scene,
    *,
    store: Store | Path | str | None = None,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    progress: bool = True,
    **axes: Iterable[Any],
) -> "pandas.DataFrame":
    """
    Carry out a sweep over crossed axes: ``sweep(Scene(), speed=[0.1, 0.2], particles=[10])``.

    Parameters
    ----------
    scene : Scene
        Base scene of all points.
    store : Store or path, optional
        Store for the results, as for ``chaincor sweep``; by default the results are not stored.
    workers : int, optional
        Number of processes; by default the number of cores. A script that calls this function needs
        the usual ``if __name__ == "__main__":``, because each worker is a new process.
    executor : concurrent.futures.Executor or distributed.Client, optional
        Executor or Dask client that replaces the new processes, as for
        :func:`~chaincor.workflows.collision.collide`.
    progress : bool
        Whether to show a progress bar, on a terminal or in a notebook.
    **axes
        Fields of a scene with their values. The last field varies fastest.

    Returns
    -------
    pandas.DataFrame
        One row for each point: the fields of the axes, then the columns of a store. If a collision
        gave no result, the column ``failure`` says why.

    Raises
    ------
    SweepError
        If an axis is no field of a scene or has no values.
    SceneError
        If a point has no valid scene. Then no collision was started.
    StoreError
        If the store cannot be used.

    Examples
    --------
    >>> from chaincor import Scene, sweep
    >>> frame = sweep(Scene(particles=5, engine="reference"), speed=[0.1, 0.4], progress=False)
    >>> frame["restitution"].round(4).tolist()
    [0.6051, 0.5805]
    """
    scene = scene_given(scene)
    require_pandas()
    workers = workers if workers is None else workers_given(workers)
    base = {key: getattr(scene, key) for key in scene.model_fields_set}
    values = read_axes(base, axes, "give a store, which keeps all results", _listed)
    fields = fields_set(values)
    refuse_shared_fields(values)
    asked = SweepPoints(base, list(values.values()), Path())
    points = scenes_of(asked.point(number) for number in range(len(asked)))
    with tempfile.TemporaryDirectory(prefix="chaincor-") as folder:
        kept = Path(folder) / "sweep.sqlite" if store is None else store
        with open_store(kept) as opened:
            store_missing(points, opened, workers=workers, executor=executor, progress=progress)
            rows = to_pandas(opened).set_index("collision_sha256", drop=False)
    frame = rows.loc[[point.collision_sha256 for point in points]].reset_index(drop=True)
    for place, name in enumerate(fields):
        column = [value_of(point, name) for point in points]
        if name in frame.columns:
            frame = frame.drop(columns=name)
        frame.insert(place, name, column)
    return frame


def _listed(name: str, axis: Any) -> list[Any]:
    """Return the values on an axis as a list, from a list, an array or a range."""
    if hasattr(axis, "tolist"):
        axis = axis.tolist()
    if isinstance(axis, str | bytes | dict) or not isinstance(axis, Iterable):
        raise SweepError(
            f"axis '{name}' is {shown(axis)}. Give a list of values: {name}=[{shown(axis)}]"
        )
    return list(axis)
