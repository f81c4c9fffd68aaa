"""How much of the energy that the engine gives is in the motion of the car at the end."""

signals = {"F": "N", "v": "m/s"}


def analyse(signals, config, run):
    force, speed = signals["F"], signals["v"]
    work, sums = 0.0, [0.0]
    for step in range(1, len(speed)):
        if step % 100 == 0:
            run.progress(step / len(speed), "adding up")
        h = speed.time[step] - speed.time[step - 1]
        work += force.values[step] * speed.values[step] * h
        sums.append(work)
    motion = config["mass"] / 2 * (speed.values[-1] ** 2 - speed.values[0] ** 2)
    run.record("work", speed.time, {"W": sums}, {"W": "J"})
    (run.folder / "energy.txt").write_text(f"{work:.0f} J of work, {motion:.0f} J of motion\n")
    share = motion / work
    return {"work": work, "motion": motion, "share": share, "summary": [f"{100 * share:.1f} % of the work moves the car."]}
