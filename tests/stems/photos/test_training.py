"""The training of the network that tells stems, on painted maps: patches, loss, and the file that is read back."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from treedgs_geo.core.files import read_json  # noqa: E402
from treedgs_geo.stems.photos.network.inference import CLASSES, STEM  # noqa: E402
from treedgs_lab.training.network import StemNet, pack  # noqa: E402
from treedgs_lab.training.train import HELD_OUT, Scenes, batch, loss_of, shares  # noqa: E402


def painted(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A map of grey noise with bright upright stems, and its labels."""
    rng = np.random.default_rng(seed)
    colour = rng.integers(40, 90, (200, 220, 3), dtype=np.uint8)
    label = np.zeros((200, 220, 5), np.uint8)
    label[..., 4] = 1
    for column in rng.integers(10, 200, 4):
        colour[:, column : column + 9] = 200
        label[:, column : column + 9, 0] = 255
    return colour, label


@pytest.fixture
def scenes(tmp_path) -> Scenes:
    for seed in range(1, HELD_OUT + 1):
        maps = [painted(seed)]
        np.savez(tmp_path / f"{seed}.npz", colour_0=maps[0][0], label_0=maps[0][1])
    found = Scenes(tmp_path)
    found.read()
    return found


def test_scenes_are_held_out_by_their_seed_and_new_ones_join(scenes):
    assert len(scenes.kept) == HELD_OUT - 1 and len(scenes.held_out) == 1
    colour, label = painted(99)
    np.savez(scenes.folder / "99.npz", colour_0=colour, label_0=label)
    scenes.read()
    assert len(scenes.kept) == HELD_OUT


def test_shares_of_the_classes_sum_to_one_inside_the_photo():
    _, label = painted(0)
    label[:20, :, 4] = 0
    found = shares(label)
    assert found.shape == (len(CLASSES), 200, 220)
    assert found[:, 20:].sum(axis=0) == pytest.approx(1.0) and (found[:, :20] == 0).all()
    assert ((found[STEM] == 1) == (label[..., 0] == 255))[20:].all()


def test_a_few_steps_teach_what_is_painted(scenes):
    torch.manual_seed(0)
    torch.set_num_threads(1)
    rng, network = np.random.default_rng(0), StemNet()
    optimiser = torch.optim.AdamW(network.parameters(), 3e-3)
    losses = []
    for _ in range(20):
        images, target = batch(rng, scenes.kept, 4)
        loss = loss_of(network(images), target)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert np.mean(losses[-3:]) < 0.6 * losses[0]


def test_a_packed_network_holds_its_card_and_its_bytes(tmp_path):
    import base64

    (tmp_path / "a.onnx").write_bytes(b"weights")
    pack(tmp_path / "a.onnx", tmp_path / "a.json", {"seeds": [1, 2]})
    found = read_json(tmp_path / "a.json")
    assert base64.b64decode("".join(found["onnx_base64"])) == b"weights"
    assert found["card"] == {"seeds": [1, 2]} and tuple(found["classes"]) == CLASSES
