"""Frames rendered in the background, as a render farm does it: files, exit codes, the log."""

import os
import re
import signal
import subprocess
from contextlib import contextmanager

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest

SIZE = 16
AS_PROGRAM = pytest.mark.skipif(not bpy.app.binary_path, reason="the bpy wheel has no blender program to start")


@pytest.fixture
def shot(empty_scene, tmp_path):
    """A white floor under a lamp of 10 W in frame 1, 20 W in frame 2, and so on to frame 20, written to out_####.exr."""
    scene = empty_scene
    make_scenes.add_floor(8.0, make_scenes.diffuse("White", (1.0, 1.0, 1.0)))
    lamp = make_scenes.add_lamp("POINT", (0, 0, 1.3), (0, 0, 0), 10.0, shadow_soft_size=0.0).data
    make_scenes.add_camera((0, 0, 2.0), (0, 0, 0))
    for frame in range(1, 21):
        lamp.energy = 10.0 * frame
        lamp.keyframe_insert("energy", frame=frame)
    scene.frame_start, scene.frame_end = 1, 20
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(tmp_path / "out_####")
    scene.sppm.iterations = 2
    return scene


def render_frames(scene, first, last):
    scene.frame_start, scene.frame_end = first, last
    assert bpy.ops.render.render(animation=True) == {"FINISHED"}


def brightness(folder):
    """{frame: mean of its picture} of all pictures in the folder."""
    return {int(path.stem[-4:]): blender_scene.read(path)[..., :3].mean() for path in sorted(folder.glob("out_*.exr"))}


def assert_frames(folder, frames):
    """These pictures and no others, each as bright as its own frame: none is stale."""
    found = brightness(folder)
    assert list(found) == list(frames)
    values = np.array(list(found.values())) / np.array(list(frames))
    assert np.allclose(values, values[0], rtol=1e-3)  # float32 sums of 10 W and of 200 W
    assert values[0] > 0


def test_animation(shot, tmp_path):
    render_frames(shot, 1, 20)
    assert_frames(tmp_path, range(1, 21))


def test_frames_that_exist_are_kept(shot, tmp_path):
    (tmp_path / "out_0002.exr").write_bytes(b"made elsewhere")
    shot.render.use_overwrite = False
    render_frames(shot, 1, 3)
    assert (tmp_path / "out_0002.exr").read_bytes() == b"made elsewhere"
    (tmp_path / "out_0002.exr").unlink()
    assert list(brightness(tmp_path)) == [1, 3]


def test_placeholder_is_there_while_the_frame_renders(shot, tmp_path):
    seen = []

    def look(*_):
        seen.append(sorted((path.name, path.stat().st_size) for path in tmp_path.glob("out_*")))

    shot.render.use_placeholder = True
    bpy.app.handlers.render_pre.append(look)
    try:
        render_frames(shot, 1, 2)
    finally:
        bpy.app.handlers.render_pre.remove(look)
    assert seen[0] == [("out_0001.exr", 0)]
    assert seen[1][1] == ("out_0002.exr", 0)
    assert_frames(tmp_path, [1, 2])


def test_placeholder_of_a_frame_that_fails_is_taken_back(shot, tmp_path):
    """An empty file would pass for a frame that somebody renders."""
    shot.camera.data.type = "PANO"
    shot.render.use_placeholder = True
    with pytest.raises(RuntimeError, match="panoramic"):
        render_frames(shot, 1, 2)
    assert list(tmp_path.glob("out_*")) == []


def test_missing_files_are_named(shot, tmp_path, capfd):
    """A texture and a library that are not where the file says; the frame is rendered all the same."""
    link_and_lose(tmp_path)
    texture_and_lose(tmp_path)
    render_frames(shot, 1, 1)
    lines = [line for line in capfd.readouterr().out.splitlines() if line.startswith("SPPM: ")]
    for name in ("wood.png", "props.blend"):
        named = [line for line in lines if str(tmp_path / name) in line]
        assert len(named) == 1, lines
    assert list(brightness(tmp_path)) == [1]


def link_and_lose(folder):
    path = folder / "props.blend"
    chair = bpy.data.objects.new("Chair", bpy.data.meshes.new("Chair"))
    bpy.data.libraries.write(str(path), {chair})
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = ["Chair"]
    bpy.context.scene.collection.objects.link(into.objects[0])
    path.unlink()


def texture_and_lose(folder):
    path = folder / "wood.png"
    image = bpy.data.images.new("wood", 4, 4)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    material = make_scenes.diffuse("Wood", (1.0, 1.0, 1.0))
    image = bpy.data.images.load(str(path))
    make_scenes.use_image(material, image)
    make_scenes.add_box("Box", (0.1, 0.1, 0.1), (0.1, 0.1, 0.1), material)
    path.unlink()
    image.reload()


# ---------------------------------------------------------------- the program


STATUS = re.compile(r"^Fra:(\d+) .*\| SPPM iteration (\d+)/(\d+), (\d+) photons, remaining (?:\d+:\d\d|--:--)$", re.MULTILINE)


@contextmanager
def running_blender(folder, *arguments):
    """`blender -b FILE ...` on a machine without a display; FILE is what is open now. It ends with the block."""
    file = folder / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [bpy.app.binary_path, "-b", "--factory-startup", "--addons", "sppm", str(file), *arguments]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def run_blender(folder, *arguments):
    """(exit code, what it printed)."""
    with running_blender(folder, *arguments) as process:
        output, _ = process.communicate(timeout=120)
    return process.returncode, output


@AS_PROGRAM
def test_a_range_of_frames_of_a_cycles_scene(shot, tmp_path):
    shot.render.engine = "CYCLES"
    code, output = run_blender(tmp_path, "-E", "SPPM", "-f", "1..5")
    assert code == 0, output
    assert_frames(tmp_path, range(1, 6))
    assert output.count("SPPM: rendered 2 iterations") == 5


@AS_PROGRAM
def test_log_tells_how_far_each_frame_is(shot, tmp_path):
    shot.sppm.indirect = "PHOTONS"
    code, output = run_blender(tmp_path, "-s", "3", "-e", "4", "-a")
    assert code == 0, output
    found = [tuple(map(int, numbers)) for numbers in STATUS.findall(output)]
    assert sorted({frame for frame, *_ in found}) == [3, 4]
    photons = [int(number) for number in re.findall(r"SPPM: rendered 2 iterations, (\d+) photons", output)]
    last = [[line for line in found if line[0] == frame][-1] for frame in (3, 4)]
    assert last == [(3, 2, 2, photons[0]), (4, 2, 2, photons[1])]
    assert photons[0] > 0


@AS_PROGRAM
def test_animation_stops_at_the_frame_that_fails(shot, tmp_path):
    """From frame 3 on the camera is one that cannot be rendered."""
    first = shot.camera
    make_scenes.add_camera((0, 0, 2.0), (0, 0, 0))
    shot.camera.data.type = "PANO"
    for frame, camera in ((1, first), (3, shot.camera)):
        shot.timeline_markers.new(f"F_{frame:02}", frame=frame).camera = camera
    shot.camera = first
    code, output = run_blender(tmp_path, "-a")
    assert code == 1
    assert "panoramic" in output
    assert_frames(tmp_path, [1, 2])


@AS_PROGRAM
def test_interrupt_ends_the_animation_without_a_picture(shot, tmp_path):
    """Ctrl-C, or a farm that takes the job back."""
    shot.sppm.iterations, shot.render.use_placeholder = 1_000_000, True
    with running_blender(tmp_path, "-a") as process:
        for line in process.stdout:
            if STATUS.match(line):
                break
        assert list(tmp_path.glob("out_*")) == [tmp_path / "out_0001.exr"]
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    assert process.returncode == 1
    assert list(tmp_path.glob("out_*")) == []
