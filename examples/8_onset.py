"""
Where nothing oscillates
========================

Below a speed every motion of run 14 comes to rest, whatever its start and the steady load: a
certificate says so, which a separate checker verifies. The lowest exact limit cycle is just above.
"""

import aeroflutter as af

found = af.onset(af.load_case("run14"))
free = found.free_below / found.flutter_speed
print(f"proved free below {free:.5f} of the flutter speed")
print(f"lowest cycle at   {found.lowest.cycle.speed_ratio:.5f}")
figure = found.plot()
