"""A robot in thirty lines: setup, odometry and scans as JSON, here of a square room (m, rad).

pip install eclipse-zenoh==1.10.2; toponym-server serve &  python3 publisher.py
"""
import json, math, sys, time
import zenoh

config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7457"]))
ROBOT, BOOT, WALL, seq = "py1", int(time.time()), 4.0, 0
STEPS = int(sys.argv[2]) if len(sys.argv) > 2 else 100


def send(session, key, **fields):
    """Publishes with the next number: one counter over all streams, or the server sees a gap."""
    global seq
    now = time.time_ns()
    stamp = {"sec": now // 10**9, "nanosec": now % 10**9}
    message = {"robot": ROBOT, "boot": BOOT, "seq": seq, "stamp": stamp, "clock": "unix", **fields}
    session.put(f"toponym/v1/default/robot/{ROBOT}/in/{key}", json.dumps(message), encoding="application/json",
                congestion_control=zenoh.CongestionControl.BLOCK)
    seq += 1


with zenoh.open(config) as session:
    laser = {"id": "front", "range_min_m": 0.05, "range_max_m": 30.0}
    send(session, "setup", map="main", lasers=[laser])
    for step in range(STEPS):
        x, angles = 0.02 * step - 1.0, [math.radians(d - 90) for d in range(181)]  # drives along x
        walls = [((WALL - x) / max(math.cos(a), 1e-9), WALL / max(abs(math.sin(a)), 1e-9)) for a in angles]
        send(session, "odom", odom_from_body={"x_m": x, "y_m": 0.0, "yaw_rad": 0.0})
        send(session, "scan/front", laser="front", angle_min_rad=angles[0], angle_increment_rad=math.radians(1),
             ranges_m=[min(w) for w in walls])
        time.sleep(0.05)
    send(session, "end")
print(f"sent {seq} messages; now say something: toponym say 'this is the square room' --robot {ROBOT}")
