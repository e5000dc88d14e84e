-- Arena: two teams throw balls into each other's goal. Barrels explode, chasers run after players, a ferry crosses the
-- middle. The match and its score are properties of the world; a ball knows who threw it; a player has a team and health.
--
-- A client sends "throw YAW PITCH", in radians as the look angles of its inputs; "grab YAW PITCH" takes the crate or
-- ball ahead, and "throw" throws it then.

local MATCH_S = 180
local BREAK_S = 10
local THROW_SPEED = 16 -- m/s
local THROW_TICKS = 30 -- between two throws of a player
local BALL_RADIUS = 0.25 -- m
local BALL_TICKS = 600 -- that a ball lives
local GRAB_REACH = 3 -- m
local HOLD_STIFFNESS, HOLD_DAMPING = 3000, 300 -- N/m, N s/m of the spring that holds what a player grabbed
local HELD_THROW_SPEED = 10 -- m/s
local HIT_IMPULSE = 10 -- N s; a ball that hits harder hurts
local HIT_DAMAGE = 25
local BARREL_IMPULSE = 12 -- N s; what hits a barrel harder sets it off
local BLAST_RADIUS = 6 -- m
local BLAST_IMPULSE = 250 -- N s at the barrel, less farther away
local BLAST_SPEED = 6 -- m/s that light things get by it
local BLAST_DAMAGE = 60
local RESPAWN_TICKS = 180
local CHASE_RADIUS = 15 -- m
local CHASE_IMPULSE = 30 -- N s, six times a second
local HOME = { red = vec(-28, 0.9, 0), blue = vec(28, 0.9, 0) }

-- In front of the team's goal, each time somewhere else.
local function home_of(team) return HOME[team] + vec(0, 0, 12 * world.random() - 6) end

-- --- The match, in the one region that has the world's record.

function on_tick()
  if world.is_own() and world.tick() == 1 then world.after(60, "second") end
end

local function begin_match()
  world.red, world.blue, world.seconds_left, world.playing = 0, 0, MATCH_S, true
  world.match = world.match + 1
end

function on_timer(name)
  if name ~= "second" then return end
  world.after(60, "second")
  world.seconds_left = world.seconds_left - 1
  if world.seconds_left > 0 then return end
  if world.playing then
    world.playing, world.seconds_left = false, BREAK_S
    print("match", world.match, "ends", world.red, "to", world.blue)
  else
    begin_match()
  end
end

local function count_player(team, more)
  local property = team .. "_players"
  world.set(property, world.get(property) + more)
end

function on_message(name, values)
  if name == "goal" then
    world.ended = world.ended + 1
    if not world.playing then return end
    world.set(values.team, world.get(values.team) + 1)
    world.count("goals")
    if values.by then values.by:send("scored") end
  elseif name == "thrown" then
    world.thrown = world.thrown + 1
  elseif name == "ended" then
    world.ended = world.ended + 1
  elseif name == "joined" then
    count_player(values.team, 1)
  elseif name == "left" then
    count_player(values.team, -1)
  end
end

-- --- Players

function on_join(player)
  local body = player:body()
  body.team = player:number() % 2 == 1 and "red" or "blue"
  player:place(home_of(body.team))
  player:send("welcome", { team = body.team })
  world.send("joined", { team = body.team })
end

-- Ends what holds the player's thing, and tells it.
local function let_go(body, velocity)
  local thing = body.held
  if not thing then return end
  body.held = nil
  body:disconnect(thing)
  thing:send("let go", { by = body, velocity = velocity })
end

-- The thing decides who holds it, so no two do; it asks for the joint, too.
local function grab(body, ahead)
  if body.held then return end
  local from = body:position() + vec(0, 0.3, 0)
  local hit = world.ray(from, from + GRAB_REACH * ahead, { kinds = { "crate", "ball" } })
  if hit then hit.body:send("grab", { by = body, at = body:position() + vec(0, 0.6, 0) + 1.5 * ahead }) end
end

function on_leave(player)
  let_go(player:body())
  world.send("left", { team = player:body().team })
end

function on_command(player, bytes)
  local words = string.split(bytes, " ")
  local yaw, pitch = tonumber(words[2] or ""), tonumber(words[3] or "")
  if (words[1] ~= "throw" and words[1] ~= "grab") or not (yaw and pitch and math.abs(yaw) < 7 and math.abs(pitch) < 1.6) then
    player:send("unknown", { command = string.sub(bytes, 1, 32) })
    return
  end
  local body = player:body()
  if player:is_spectating() or world.tick() < body.ready_at then return end
  local ahead = vec(-math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch))
  if words[1] == "grab" then return grab(body, ahead) end
  if body.held then
    body.ready_at = world.tick() + THROW_TICKS
    return let_go(body, body:velocity() + HELD_THROW_SPEED * ahead)
  end
  -- Short of a wall: nothing is made inside of one.
  local eye = body:position() + vec(0, 0.6, 0)
  local wall = world.ray(eye, eye + ahead, { dynamic = false })
  local from = eye + (wall and math.max(wall.distance - BALL_RADIUS, 0) or 1) * ahead
  local ball = world.spawn("ball", from, { velocity = body:velocity() + THROW_SPEED * ahead, predicted = player })
  ball.thrower, ball.team = body, body.team
  ball:after(BALL_TICKS, "end")
  body.ready_at = world.tick() + THROW_TICKS
  world.send("thrown")
  world.count("throws")
end

-- A player who has no health left looks on, and comes back at home.
local function hurt(body, damage)
  local player = body:player()
  if player:is_spectating() then return end
  body.health = body.health - damage
  if body.health > 0 then return end
  player:send("out")
  let_go(body)
  player:spectate(body:position() + vec(0, 5, 0))
  body:after(RESPAWN_TICKS, "respawn")
end

kinds.player = {
  on_message = function(self, name, values)
    if name == "hit" then
      hurt(self, values.damage)
    elseif name == "scored" then
      self.goals = self.goals + 1
      self:player():send("goal", { goals = self.goals })
    elseif name == "holds" then
      -- A player who has gone out or grabbed something else meanwhile lets go of it.
      if self:player():is_spectating() or self.held then
        self:disconnect(values.thing)
        values.thing:send("let go", { by = self })
      else
        self.held = values.thing
      end
    elseif name == "lost" and self.held == values.thing then
      self.held = nil
    end
  end,
  on_blast = function(self, blast) hurt(self, math.floor(BLAST_DAMAGE * blast.share)) end,
  on_timer = function(self, name)
    if name ~= "respawn" then return end
    self.health = 100
    self:player():respawn(home_of(self.team))
  end,
}

-- --- Things

local function be_held(self, name, values)
  if name == "grab" then
    -- A holder who has left without a word holds nothing.
    if (self.holder and self.holder:is_here()) or not values.by:is_here() then return end
    self.holder = values.by
    values.by:connect(self, {
      kind = "spring", at = values.at, stiffness = HOLD_STIFFNESS, damping = HOLD_DAMPING, collide = true,
      answer = "held",
    })
  elseif name == "held" then
    if not self.holder then return end
    if values.connected then
      self.holder:send("holds", { thing = self })
    else
      self.holder = nil
    end
  elseif name == "let go" and self.holder == values.by then
    self.holder = nil
    if values.velocity then self:set_velocity(values.velocity) end
  end
end

kinds.crate = { on_message = be_held }

kinds.ball = {
  on_message = be_held,
  on_entered = function(self, other)
    if other:kind() ~= "goal" or other.team == self.team then return end
    world.send("goal", { team = self.team, by = self.thrower })
    if self.holder then self.holder:send("lost", { thing = self }) end
    self:remove()
  end,
  on_contact = function(self, other, contact)
    if other:kind() == "player" and contact and contact.impulse > HIT_IMPULSE and other ~= self.thrower then
      other:send("hit", { damage = HIT_DAMAGE })
    end
  end,
  on_timer = function(self, name)
    world.send("ended")
    if self.holder then self.holder:send("lost", { thing = self }) end
    self:remove()
  end,
}

kinds.barrel = {
  on_contact = function(self, other, contact)
    if not contact or contact.impulse < BARREL_IMPULSE then return end
    world.explode({
      at = self:position(), radius = BLAST_RADIUS, impulse = BLAST_IMPULSE, speed = BLAST_SPEED, lift = 1, name = "barrel",
    })
    world.count("blasts")
    self:remove()
  end,
}

kinds.chaser = {
  on_tick = function(self)
    if world.tick() % 10 ~= 0 then return end
    local here, nearest, best = self:position(), nil, CHASE_RADIUS
    for _, body in ipairs(world.overlap({ radius = CHASE_RADIUS }, here, { kinds = "player" })) do
      local distance = (body:position() - here):length()
      if distance < best then nearest, best = body, distance end
    end
    if not nearest or best < 0.1 then return end
    local way = (nearest:position() - here) / best
    self:impulse(CHASE_IMPULSE * vec(way.x, 0, way.z))
  end,
}
