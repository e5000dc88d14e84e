# What the plug-in does in the engine itself, in the fake instance's world: two bodies that go round in circles of 3 m,
# of which the scene knows one. Run by engine_test.sh; the exit code is 1 where something does not hold.
#
#   godot --headless --path PROJECT --script res://check.gd -- GRANT_FILE
extends SceneTree

const LIMIT_S := 30.0

var world: TesseraWorld
var grant_file := ""
var drawing := 1
var entered := {}
var left := []
var joined := []
var first := Vector3.INF
var since_s := 0.0
var failures := 0


func expect(holds: bool, what: String) -> void:
	if not holds:
		failures += 1
		print("FAILED: ", what)


func _initialize() -> void:
	grant_file = OS.get_cmdline_user_args()[0]
	start()


func start() -> void:
	entered = {}
	left = []
	joined = []
	first = Vector3.INF
	since_s = 0.0
	world = TesseraWorld.new()
	world.drawing = drawing
	world.grant = FileAccess.get_file_as_bytes(grant_file)
	expect(world.grant == FileAccess.get_file_as_bytes(grant_file), "the grant is kept")
	world.joined.connect(func(player: int, scene: String) -> void: joined = [player, scene])
	world.left.connect(func(reason: String) -> void: left.append(reason))
	world.body_entered.connect(func(id: int, node: Node3D) -> void: entered[id] = node)
	root.add_child(world)


func _process(seconds: float) -> bool:
	since_s += seconds
	if since_s > LIMIT_S or not left.is_empty():
		expect(false, "the world is joined and moves; left: %s, entered: %s" % [left, entered.keys()])
		quit(1)
		return true
	if joined.is_empty() or not entered.has(1) or not entered.has(2):
		return false
	var at := position_of_ball()
	if first == Vector3.INF:
		first = at
	if at.distance_to(first) < 1.0:
		return false
	check(at)
	if drawing == 1:
		drawing = 2
		start()
		return false
	print("check: ", "passed" if failures == 0 else "%d failed" % failures)
	quit(0 if failures == 0 else 1)
	return true


func position_of_ball() -> Vector3:
	if drawing == 1:
		return world.body_node(1).position
	var instances := world.find_children("*", "MultiMeshInstance3D", true, false)
	if instances.is_empty():
		return Vector3.ZERO
	var rows: PackedFloat32Array = instances[0].multimesh.buffer  # its transforms are not kept without a window
	return Vector3(rows[3], rows[7], rows[11])


func check(at: Vector3) -> void:
	expect(joined[1] == "plaza" and joined[0] == world.get_player(), "who plays, and where")
	expect(absf(at.y - 1.0) < 0.01 and absf(Vector2(at.x + 5.0, at.z).length() - 3.0) < 0.2, "on its circle: %s" % at)
	expect(entered[2] == null, "the scene does not know the other body, so it is not drawn")
	var mesh: Mesh
	if drawing == 1:
		expect(world.body_node(1) == entered[1] and entered[1].name == "body_1", "the node of the signal")
		mesh = world.body_node(1).get_child(0).mesh
	else:
		expect(world.body_node(1) == null, "no node")
		var multimesh: MultiMesh = world.find_children("*", "MultiMeshInstance3D", true, false)[0].multimesh
		expect(multimesh.visible_instance_count == 1, "one instance")
		mesh = multimesh.mesh
	expect(mesh.get_aabb().size.distance_to(Vector3.ONE) < 0.1, "a ball of half a metre: %s" % mesh.get_aabb())
	expect(world.body_property(1, "team") == "red" and world.body_property(1, "nonsense") == null, "properties")
	expect(world.call("world_property", "phase") == "waiting", "a call by name")
	expect(world.send("use") == 0 and world.send_bytes(PackedByteArray([1, 2])) == 0, "commands")
	expect(world.send("x".repeat(2000)) == 3 and world.get_last_error().contains("2000"), "one that is too long")
	world.push(Vector3(10, 0, 0), Vector3.ZERO)
	world.steer(Vector2(0, 1), 0.5, 0.0, 1)
	world.leave(100)
	expect(left == [""] and world.get_state() == 3, "it has left")
	left = []
	world.queue_free()
