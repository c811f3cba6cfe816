"""Writes random messages as PyPI's rosbags serializes them, for the test `random_values_of_others…`:

    pip install rosbags numpy
    python ros/tests/random_values.py 10000 > random.cdr
    TOPONYM_CDR=random.cdr cargo test --workspace --test others -- random_values

Each: the type's name, the message in either order of bytes, the same little-endian; each behind its length of 4 bytes.
"""
import random, struct, sys
import numpy as np
from rosbags.typesys import Stores, get_typestore, get_types_from_msg

TYPES = """sensor_msgs/msg/LaserScan nav_msgs/msg/Odometry tf2_msgs/msg/TFMessage std_msgs/msg/String
rosgraph_msgs/msg/Clock nav_msgs/msg/OccupancyGrid nav_msgs/msg/MapMetaData nav_msgs/msg/Path
geometry_msgs/msg/PoseStamped geometry_msgs/msg/PoseWithCovarianceStamped sensor_msgs/msg/PointCloud2
visualization_msgs/msg/MarkerArray std_srvs/srv/Trigger_Response toponym_msgs/srv/Where_Request
toponym_msgs/srv/Where_Response""".split()

store = get_typestore(Stores.ROS2_JAZZY)
# It knows parts of services as messages.
for kind, definition in [
    ("std_srvs/srv/Trigger_Response", "bool success\nstring message"),
    ("toponym_msgs/srv/Where_Request", "string name\nstring robot"),
    ("toponym_msgs/srv/Where_Response",
     "bool found\nfloat64 probability\nfloat64 p_none\ngeometry_msgs/PoseStamped pose\nstring message"),
]:
    store.register(get_types_from_msg(definition, kind.replace("/srv/", "/msg/")))
rng = random.Random(1)
LETTERS = "abc xyz_/ÄöüßéøЖ語🙂"
DTYPES = {"bool": "?", "int8": "i1", "uint8": "u1", "byte": "u1", "char": "u1", "int16": "i2", "uint16": "u2", "int32": "i4",
          "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"}


def number(kind):
    if kind == "bool":
        return rng.random() < 0.5
    if kind.startswith("float"):
        value = rng.choice([0.0, -0.0, float("inf"), float("-inf"), float("nan"), rng.gauss(0, 1), rng.gauss(0, 1e9)])
        return float(np.float32(value)) if kind == "float32" else value
    bits = 8 if kind in ("byte", "char") else int(kind.lstrip("uint"))
    return rng.randrange(-(1 << bits - 1), 1 << bits - 1) if kind.startswith("int") else rng.randrange(1 << bits)


def text():
    return "".join(rng.choice(LETTERS) for _ in range(rng.randrange(12)))


def value(description):
    shape, of = description
    name = shape.name
    if name == "BASE":
        return text() if of[0] in ("string", "wstring") else number(of[0])
    if name == "NAME":
        return message(of)
    inner, length = of
    count = length if name == "ARRAY" else rng.randrange(5)
    if inner[0].name == "BASE" and inner[1][0] != "string":
        kind = inner[1][0]
        return np.array([number(kind) for _ in range(count)], dtype=DTYPES[kind])
    return [value(inner) for _ in range(count)]


def message(kind):
    fields = store.fielddefs[kind][1]
    return store.types[kind](**{name: value(of) for name, of in fields})


out = sys.stdout.buffer
for n in range(int(sys.argv[1])):
    kind = TYPES[n % len(TYPES)]
    of = kind.replace("/srv/", "/msg/")
    kept = message(of)
    either = bytes(store.serialize_cdr(kept, of, little_endian=n % 7 != 0))
    little = bytes(store.serialize_cdr(kept, of, little_endian=True))
    for part in (kind.encode(), either, little):
        out.write(struct.pack("<I", len(part)) + part)
