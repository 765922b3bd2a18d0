"""Walls in the kernel: where they are, how fast a point of them moves, and the nearest point to a grain."""

import taichi as ti

from taichidem.contact import vec3
from taichidem.shapes.sphere import Nearest
from taichidem.state import OnTables


@ti.data_oriented
class WallMotion(OnTables):
    """The rigid motion of walls, and the search over wall kinds (unrolled by the compiler)."""

    def __init__(self, state) -> None:
        super().__init__(state)
        self.kinds = state.wall_kinds
        self.meshes = state.meshes
        self.mesh_cells = state.mesh_cells

    @ti.func
    def move(self, w, dt):
        """Advance every moving wall of a world and add up how far the fastest point may have come."""
        first = self.worlds[w].first_wall
        fastest = 0.0
        for k in range(first, first + self.worlds[w].walls):
            present = self.present(w, k)
            if present:
                self._push(k, dt)
            self.walls[k].force = vec3(0.0)
            self.walls[k].torque = vec3(0.0)
            if self.walls[k].moves == 1 and present:
                wall = self.walls[k]
                self.walls[k].origin = wall.origin + dt * wall.velocity
                rate = wall.spin.norm()
                if rate > 0.0:
                    axis = wall.spin / rate
                    # The rows of Rᵀ turn with the wall: row ← turned row, by Rodrigues' formula, per world axis.
                    turn = self._turn(axis, rate * dt)
                    first_row = turn[0, 0] * wall.first_row + turn[0, 1] * wall.second_row + turn[0, 2] * wall.third_row
                    second_row = (
                        turn[1, 0] * wall.first_row + turn[1, 1] * wall.second_row + turn[1, 2] * wall.third_row
                    )
                    third_row = turn[2, 0] * wall.first_row + turn[2, 1] * wall.second_row + turn[2, 2] * wall.third_row
                    self.walls[k].first_row = first_row
                    self.walls[k].second_row = second_row
                    self.walls[k].third_row = third_row
                    self.walls[k].turned = 1
                fastest = ti.max(fastest, wall.velocity.norm() + rate * wall.extent)
        self.worlds[w].wall_travel = self.worlds[w].wall_travel + fastest * dt

    @ti.func
    def _push(self, k, dt):
        """Let load and grains accelerate a loaded wall along its guide."""
        wall = self.walls[k]
        push = wall.load + wall.force.dot(wall.guide)
        self.walls[k].velocity = wall.velocity + (dt * wall.inverse_mass * push) * wall.guide

    @ti.func
    def present(self, w, k):
        """Return whether a wall has not been taken away."""
        return self.worlds[w].step * self.worlds[w].dt < self.walls[k].removed_at

    @ti.func
    def forget_forces(self, w):
        """Empty what a world's walls feel, before an evaluation that no motion comes before."""
        first = self.worlds[w].first_wall
        for k in range(first, first + self.worlds[w].walls):
            self.walls[k].force = vec3(0.0)
            self.walls[k].torque = vec3(0.0)

    @ti.func
    def arm(self, element, point):
        """Return the vector from the centre of a wall's motion to a world point [m]."""
        return point - self.walls[self.wall_elements[element].wall].origin

    @ti.func
    def feel(self, element, force, torque):
        """Add the reaction of a grain to what its wall feels; one thread per world may call this."""
        wall = self.wall_elements[element].wall
        self.walls[wall].force = self.walls[wall].force - force
        self.walls[wall].torque = self.walls[wall].torque - torque

    @ti.func
    def _turn(self, axis, angle):
        c, s = ti.cos(angle), ti.sin(angle)
        x, y, z = axis[0], axis[1], axis[2]
        return ti.Matrix(
            [
                [c + x * x * (1.0 - c), x * y * (1.0 - c) - z * s, x * z * (1.0 - c) + y * s],
                [y * x * (1.0 - c) + z * s, c + y * y * (1.0 - c), y * z * (1.0 - c) - x * s],
                [z * x * (1.0 - c) - y * s, z * y * (1.0 - c) + x * s, c + z * z * (1.0 - c)],
            ]
        )

    @ti.func
    def to_world(self, wall, local):
        """Return a direction of the wall's frame in the world; the stored rows are those of R."""
        v = local
        if self.walls[wall].turned == 1:
            v = vec3(
                self.walls[wall].first_row.dot(local),
                self.walls[wall].second_row.dot(local),
                self.walls[wall].third_row.dot(local),
            )
        return v

    @ti.func
    def to_wall(self, wall, position):
        """Return a world position in the wall's frame."""
        away = position - self.walls[wall].origin
        if self.walls[wall].turned == 1:
            away = (
                away[0] * self.walls[wall].first_row
                + away[1] * self.walls[wall].second_row
                + away[2] * self.walls[wall].third_row
            )
        return away

    @ti.func
    def facets_near(self, mesh, position):
        """Return the first and the last row (exclusive) of the facets listed where a world position lies in a mesh."""
        m = self.meshes[mesh]
        at = (self.to_wall(m.wall, position) - m.lower) / m.cell_size
        x, y, z = int(ti.floor(at[0])), int(ti.floor(at[1])), int(ti.floor(at[2]))
        start, end = 0, 0
        if x >= 0 and x < m.cells_x and y >= 0 and y < m.cells_y and z >= 0 and z < m.cells_z:
            cell = m.first_cell + (z * m.cells_y + y) * m.cells_x + x
            start, end = self.mesh_cells[cell].start, self.mesh_cells[cell + 1].start
        return start, end

    @ti.func
    def nearest(self, element, position, radius, time):
        """Return the nearest point of a wall element to a world position; nothing counts once the wall is removed."""
        wall = self.wall_elements[element].wall
        kind = self.wall_elements[element].kind
        row = self.wall_elements[element].row
        local = self.to_wall(wall, position)
        near = Nearest(point=position, normal=vec3(0.0, 0.0, 1.0), distance=1e300, counts=0)
        if time < self.walls[wall].removed_at:
            for k in ti.static(range(len(self.kinds))):
                if kind == k:
                    near = self.kinds[k].nearest(row, local, radius)
            near.point = self.walls[wall].origin + self.to_world(wall, near.point)
            near.normal = self.to_world(wall, near.normal)
        return near

    @ti.func
    def bend(self, element):
        """Return -1 for an endless plane, 0 for flat pieces of surfaces, 1 for those that may bend towards grains."""
        answer = 0
        for k in ti.static(range(len(self.kinds))):
            answer += self.kinds[k].bend * ti.cast(self.wall_elements[element].kind == k, ti.i32)
        return answer

    @ti.func
    def velocity(self, element, point):
        """Return the velocity of the wall at a world point [m/s]."""
        wall = self.wall_elements[element].wall
        speed = vec3(0.0)
        if self.walls[wall].moves == 1:
            speed = self.walls[wall].velocity + self.walls[wall].spin.cross(point - self.walls[wall].origin)
        return speed

    @ti.func
    def spin(self, element):
        """Return the angular velocity of the wall [rad/s]."""
        return self.walls[self.wall_elements[element].wall].spin
