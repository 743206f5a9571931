"""A camera calibrated by mrcal (Kogan), a process of Debian's Python: corners as JSON come in, what was found goes out.

In: size (width, height) px; spacing m; focal px, a guess; observations (views, rows, columns, 3) u, v and weight, which
is below 0 where a corner was not seen. Out: intrinsics (9,) of LENSMODEL_OPENCV5, frames (views, 6), warp (2,) m.
"""

import json
import sys

import mrcal
import numpy as np


def main() -> None:
    given = json.load(sys.stdin)
    observations, sizes = np.array(given["observations"]), np.array([given["size"]], dtype=np.int32)
    count = len(observations)
    indices = np.column_stack([np.arange(count), np.zeros(count)]).astype(np.int32)
    core, _, frames = mrcal.seed_stereographic(sizes, given["focal"], indices, observations, given["spacing"])
    views = np.column_stack([indices, np.full(count, -1)]).astype(np.int32)
    warp = np.zeros(2)
    # the stages of its own tool: poses, then the pinhole, then the lens, then the board's form and stray corners
    lens = np.concatenate([core, np.zeros((1, 5))], axis=1)
    stages = ({"do_optimize_intrinsics_core": False, "do_optimize_intrinsics_distortions": False},)
    stages += ({"do_optimize_intrinsics_distortions": False}, {}, {})
    for number, stage in enumerate(stages):
        last = number == len(stages) - 1
        mrcal.optimize(
            intrinsics=lens,
            extrinsics_rt_fromref=None,
            frames_rt_toref=frames,
            points=None,
            observations_board=observations,
            observations_point=None,
            indices_point_camintrinsics_camextrinsics=None,
            lensmodel="LENSMODEL_OPENCV5",
            calobject_warp=warp,
            do_optimize_calobject_warp=last,
            do_apply_outlier_rejection=last,
            do_apply_regularization=True,
            imagersizes=sizes,
            calibration_object_spacing=given["spacing"],
            indices_frame_camintrinsics_camextrinsics=views,
            **stage,
        )
    json.dump({"intrinsics": lens[0].tolist(), "frames": frames.tolist(), "warp": warp.tolist()}, sys.stdout)


if __name__ == "__main__":
    main()
