"""A planner in forty lines: asks where something is, over JSON, and prints where to go.

pip install eclipse-zenoh==1.10.2; python3 planner.py kitchen [MAP [ENDPOINT]]
"""
import json, math, sys, time
from urllib.parse import quote
import zenoh


def ask(session, key, timeout_s=5.0, **arguments):
    """One question, one answer. Zenoh answers nothing for a moment after a server came back: ask again."""
    selector = key + "?" + ";".join(f"{name}={quote(str(value), safe='')}" for name, value in arguments.items())
    deadline = time.monotonic() + timeout_s
    while True:
        for reply in session.get(selector, timeout=timeout_s):
            if reply.ok is not None:
                return json.loads(reply.ok.payload.to_string())
            error = json.loads(reply.err.payload.to_string())["error"]
            sys.exit(f"refused ({error['code']}): {error['message']} {error['hint'] or ''}")
        if time.monotonic() > deadline:
            sys.exit(f"nobody answers on {key}")
        time.sleep(0.1)


def main(name, map_id="main", endpoint="tcp/127.0.0.1:7457"):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        answer = ask(session, f"toponym/v1/default/map/{map_id}/ask/where", name=name)
    print(f"nowhere in the map with probability {answer['p_none']:.2f}")
    for candidate in answer["candidates"]:
        goal, robot = candidate["goal"] or candidate, candidate["from_robot"]
        way = f", {robot['distance_m']:.1f} m at {math.degrees(robot['bearing_rad']):.0f}°" if robot else ""
        print(f"{candidate['label']}: {candidate['probability']:.2f} at ({goal['x_m']:.2f}, {goal['y_m']:.2f}) m{way}")
    return 0 if answer["candidates"] else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]) if len(sys.argv) > 1 else __doc__)
