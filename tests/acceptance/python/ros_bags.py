"""Makes bags of ROS 2 with many message types and random values, reads them and others with the readers of others, and writes what they
found: ros_bags.py FOLDER [BAG...]"""
import array
import json
import random
import shutil
import sys
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

EPOCH = 1_700_000_000_123_456_789
LONGEST = 64
random.seed(36)

store = get_typestore(Stores.ROS2_HUMBLE)
OWN = {
    "demo_msgs/msg/Wheel": "uint8 FRONT=0\nuint8 side\nfloat32 slip  # [-]\nstring<=8 name \"a # b\"\n",
    "demo_msgs/msg/All": "\n".join(
        [f"{kind} a_{kind}" for kind in "bool byte char int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64 string".split()]
        + ["string text", "uint8 last", "float64 aligned", "bool[3] flags", "int64[<=4] some", "float64[] any", "string[2] words", "Wheel[4] wheels",
           "Wheel[] more", "float32[100] long", "std_msgs/Empty nothing", "uint16 behind", "builtin_interfaces/Time stamp_of", "uint64[2] big"]
    ),
    "ackermann_msgs/msg/AckermannDrive": "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\nfloat32 acceleration\nfloat32 jerk\n",
    "demo_msgs/msg/Changing": "int32 before\nfloat64[] list\nfloat64 behind\n",
}
for name, text in OWN.items():
    store.register(get_types_from_msg(text, name))
PACKAGES = ("builtin_interfaces", "std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "diagnostic_msgs", "rcl_interfaces", "rosgraph_msgs")
TYPES = sorted(name for name in store.types if name.split("/")[0] in PACKAGES) + list(OWN) + ["tf2_msgs/msg/TFMessage"]
FEW = list(dict.fromkeys(TYPES[::6] + TYPES[-5:]))
# rosbags writes no byte above 127, and mcap-ros2-support gives characters a sign; in ROS 2 neither has one.
BITS = {"byte": (0, 127), "char": (0, 127)} | {
    f"{sign}int{bits}": ((0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)) for sign in ("", "u") for bits in (8, 16, 32, 64)
}
DTYPE = {"bool": "bool", "byte": "uint8", "char": "uint8"}


def scalar(kind):
    if kind == "bool":
        return random.random() < 0.5
    if kind == "string":
        return "".join(random.choice("abc äπ,;\"'.") for _ in range(random.randrange(9)))
    if kind in BITS:
        least, most = BITS[kind]
        return random.choice([least, most, random.randint(least, most)])
    value = random.uniform(-1, 1) * 10 ** random.randint(-30, 30)
    return float(numpy.float32(value)) if kind == "float32" else value


def value(desc, length):
    node, inner = desc
    if node == Nodetype.BASE:
        return scalar(inner[0])
    if node == Nodetype.NAME:
        return message(inner)
    element, count = inner
    count = count if node == Nodetype.ARRAY else min(length, count or length)
    values = [value(element, 2) for _ in range(count)]
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        return numpy.array(values, dtype=DTYPE.get(element[1][0], element[1][0]))
    return values


def message(name, length=3):
    fields = store.get_msgdef(name).fields
    return store.types[name](**{field: value(desc, length) for field, desc in fields})


def idl(name):
    """The definition in IDL, as rosidl writes it: arrays have types of their own."""
    done, text = [], []

    def kind(desc):
        node, inner = desc
        names = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}
        if node == Nodetype.BASE:
            return names.get(inner[0], inner[0]) + (f"<{inner[1]}>" if inner[0] == "string" and inner[1] else "")
        if node == Nodetype.NAME:
            if inner not in done:
                visit(inner)
            return inner.replace("/", "::")
        element = kind(inner[0])
        return f"sequence<{element}{f', {inner[1]}' if inner[1] else ''}>" if node == Nodetype.SEQUENCE else (element, inner[1])

    def visit(name):
        done.append(name)
        package, _, short = name.split("/")
        typedefs, fields = [], []
        for field, desc in store.get_msgdef(name).fields:
            written = kind(desc)
            if isinstance(written, tuple):
                alias = f"{written[0].replace('::', '__').replace('<', '_').replace('>', '')}__{written[1]}"
                typedefs.append(f"    typedef {written[0]} {alias}[{written[1]}];")
                written = alias
            fields.append(f"      @verbatim (language=\"comment\", text=\n        \"a comment\" \"of two\")\n      {written} {field};")
        body = [f"module {package} {{\n  module msg {{\n    module {short}_Constants {{ const uint8 ONE = 1; }};"]
        body += list(dict.fromkeys(typedefs)) + [f"    struct {short} {{"] + fields + ["    };\n  };\n};\n"]
        text.append(f"{'=' * 80}\nIDL: {name}\n" + "\n".join(body))

    visit(name)
    return "".join(reversed(text))


def make(path, plugin, mode=CompressionMode.NONE, form="msg", big=False, types=FEW):
    shutil.rmtree(path, ignore_errors=True)
    writer = Writer(path, version=9, storage_plugin=plugin)
    if mode != CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for index, name in enumerate(types):
            topic = "/" + name.replace("/msg/", "/").lower()
            own = {"msgdef": idl(name), "rihs01": store.hash_rihs01(name)} if form == "idl" else {"typestore": store}
            connection = writer.add_connection(topic, name, **own)
            for row in range(4):
                made = message(name, row if name.endswith("Changing") else 3)
                if name.endswith("TFMessage"):
                    for k, transform in enumerate(made.transforms[: 2 + row % 2]):
                        transform.child_frame_id = f"frame_{k}.x/y"
                    made.transforms = made.transforms[: 2 + row % 2]
                data = store.serialize_cdr(made, name, little_endian=not big)
                writer.write(connection, EPOCH + 10_000_000 * row + index, bytes(data))
    return path


def drive(path):
    """A drive at 20 m/s in two files of a database each: speed, yaw rate and steering."""
    halves = [path.with_name(f"{path.name}_half_{k}") for k in range(2)]
    for k, half in enumerate(halves):
        shutil.rmtree(half, ignore_errors=True)
        with Writer(half, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
            kinds = {"/odom": "nav_msgs/msg/Odometry", "/imu/data": "sensor_msgs/msg/Imu", "/steer": "ackermann_msgs/msg/AckermannDrive"}
            topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
            for row in range(50 * k, 50 * k + 50 + k):
                time = EPOCH + 10_000_000 * row
                for topic, connection in topics.items():
                    made = message(connection.msgtype)
                    if topic != "/steer":
                        made.header.stamp.sec, made.header.stamp.nanosec = divmod(time, 10**9)
                    if topic == "/odom":
                        made.twist.twist.linear.x = 20.0 + row / 100
                    if topic == "/imu/data":
                        made.angular_velocity.z = row / 1000
                    if topic == "/steer":
                        made.steering_angle = row / 1024
                    late = 0 if topic == "/steer" else 1_000_000 * (1 + row % 3)
                    writer.write(connection, time + late, bytes(store.serialize_cdr(made, connection.msgtype)))
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    names = []
    for half in halves:
        (file,) = half.glob("*.db3")
        names.append(file.name)
        shutil.copy(file, path / file.name)
    text = (halves[0] / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(text.replace(f"- {names[0]}", f"- {names[0]}\n  - {names[1]}", 1))
    return path


def flat(it, path, into, lists):
    """Numbers and texts by their paths; lists with their lengths."""
    fields = getattr(it, "__slots__", None) if hasattr(it, "_full_text") else None
    if hasattr(it, "__msgtype__"):
        fields = [name for name, _ in store.get_msgdef(it.__msgtype__).fields]
        for name, (node, inner) in store.get_msgdef(it.__msgtype__).fields:
            # rosbags gives bytes a sign; in ROS 2 they are octets, which have none.
            if node == Nodetype.BASE and inner[0] == "byte":
                setattr(it, name, getattr(it, name) & 255)
            elif node in (Nodetype.ARRAY, Nodetype.SEQUENCE) and inner[0][1][0] == "byte":
                setattr(it, name, [int(element) & 255 for element in getattr(it, name)])
    if isinstance(it, (list, tuple, bytes, numpy.ndarray, array.array, memoryview)):
        lists[path] = len(it)
        if len(it) <= LONGEST:
            for k, element in enumerate(it):
                flat(element, f"{path}.{k}", into, lists)
    elif fields is not None:
        for name in fields:
            # What ROS 2 puts into messages without fields.
            if name != "structure_needs_at_least_one_member":
                flat(getattr(it, name), f"{path}.{name}", into, lists)
    elif isinstance(it, str):
        into[path] = {"text": it}
    elif isinstance(it, (float, numpy.floating)):
        into[path] = {"number": float(it).hex()}
    else:
        into[path] = {"integer": str(int(it))}


def columns(rows):
    """Rows of a topic as columns; those in lists that change are left out."""
    tables = {}
    for topic, log_time, message in rows:
        parts = [(topic, message)]
        if all(hasattr(it, "child_frame_id") for it in getattr(message, "transforms", [None])):
            parts = [(f"{topic}.transforms.{it.child_frame_id}", it) for it in message.transforms]
        for name, part in parts:
            values, lists = {}, {}
            flat(part, name, values, lists)
            tables.setdefault(name, []).append((log_time, values, lists))
    found = {}
    for table in tables.values():
        first = table[0][2]
        wrong = [path for path, length in first.items() if any(it[2].get(path) != length for it in table)]
        wrong += [path for _, _, lists in table for path in lists if path not in first]
        for path in table[0][1]:
            if any(path.startswith(f"{it}.") for it in wrong):
                continue
            found[path] = {"times": [str(it[0]) for it in table], "values": [it[1][path] for it in table]}
    return found


def by_rosbags(path):
    with Reader(path) as reader:
        for connection in reader.connections:
            if connection.msgtype not in store.types:
                types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
                store.register({name: fields for name, fields in types.items() if name not in store.types})
        for connection, time, data in reader.messages():
            yield connection.topic, time, store.deserialize_cdr(data, connection.msgtype)


def by_mcap_ros2(path):
    with open(path, "rb") as file:
        for _, channel, message, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            yield channel.topic, message.log_time, decoded


folder, others = Path(sys.argv[1]), [Path(it) for it in sys.argv[2:]]
MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3
bags = [
    make(folder / "mcap_msg", MCAP, types=TYPES),
    make(folder / "mcap_idl", MCAP, form="idl"),
    make(folder / "mcap_big", MCAP, big=True),
    make(folder / "mcap_storage", MCAP, CompressionMode.STORAGE),
    make(folder / "mcap_file", MCAP, CompressionMode.FILE),
    make(folder / "mcap_message", MCAP, CompressionMode.MESSAGE),
    make(folder / "db3_msg", SQLITE),
    make(folder / "db3_idl", SQLITE, form="idl"),
    make(folder / "db3_file", SQLITE, CompressionMode.FILE),
    make(folder / "db3_message", SQLITE, CompressionMode.MESSAGE),
]
bags.append(drive(folder / "drive"))
judged = [(bag, "rosbags", by_rosbags(bag)) for bag in bags]
for name in ("mcap_msg", "mcap_big", "mcap_storage"):
    (file,) = (folder / name).glob("*.mcap")
    judged.append((file, "mcap_ros2", by_mcap_ros2(file)))
judged += [(bag, "mcap_ros2", by_mcap_ros2(bag)) for bag in others if bag.suffix == ".mcap"]
judged += [(bag, "rosbags", by_rosbags(bag)) for bag in others]
found = [{"bag": str(bag), "judge": judge, "columns": columns(rows)} for bag, judge, rows in judged]
(folder / "expected.json").write_text(json.dumps(found))
