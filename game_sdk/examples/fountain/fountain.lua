-- Balls spring from a fountain, count what they hit, and go after a while. fountain.cpp is the same game in C++.

function on_tick()
  if world.tick() % 10 ~= 0 then return end
  local place = vec(world.random() * 20 - 10, 2, world.random() * 20 - 10)
  local ball = world.spawn("ball", place, { velocity = vec(world.random() * 8 - 4, 0, world.random() * 8 - 4) })
  ball:after(90, "go", { lift = 2.5 })
end

kinds.ball = {
  on_contact = function(self, other)
    self.hits = self.hits + 1
  end,
  on_timer = function(self, name, values)
    if self.hits == 0 then
      self:remove()
    else
      self.hits = 0
      self:impulse(vec(0, values.lift * self:mass(), 0))
      self:after(60, name, values)
    end
  end,
}
