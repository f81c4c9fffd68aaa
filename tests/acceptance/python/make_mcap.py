"""Writes a recording as other programs do, JSON at 10 Hz and protobuf at 100 Hz: make_mcap.py MCAP"""
import json
import sys

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import CompressionType
from mcap_protobuf.writer import Writer

EPOCH = 1_700_000_000_000_000_000
MS = 1_000_000

file = descriptor_pb2.FileDescriptorProto(name="imu.proto", package="car", syntax="proto3")
vector = file.message_type.add(name="Vector")
for number, axis in enumerate("xyz", 1):
    vector.field.add(name=axis, number=number, label=1, type=1)
imu = file.message_type.add(name="Imu")
imu.field.add(name="accel", number=1, label=1, type=11, type_name=".car.Vector")
imu.field.add(name="count", number=2, label=1, type=3)
imu.field.add(name="frame", number=3, label=1, type=9)
pool = descriptor_pool.DescriptorPool()
pool.Add(file)
Imu = message_factory.GetMessageClass(pool.FindMessageTypeByName("car.Imu"))

with open(sys.argv[1], "wb") as stream, Writer(stream, chunk_size=2048, compression=CompressionType.ZSTD) as writer:
    plain = writer._writer
    schema = plain.register_schema("gps", "jsonschema", b'{"type": "object"}')
    gps = plain.register_channel("/gps", "json", schema, {"unit:v": "km/h"})
    for k in range(101):
        stamp, t = EPOCH + 10 * k * MS, k / 100
        message = Imu(count=k, frame="body")
        message.accel.x = t * t
        writer.write_message("/imu", message, log_time=stamp, publish_time=stamp + k)
        if k % 10 == 0:
            fix = {"v": 36 + 72 * t, "fix": {"ok": k > 40, "name": "rtk"}}
            plain.add_message(gps, stamp, json.dumps(fix).encode(), stamp)
