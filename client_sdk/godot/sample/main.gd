# Joins a world by a grant's file, walks in it by the arrow keys, and prints what happens.
#
#   godot --path sample -- GRANT_FILE
extends Node3D

const FORCE_N := 500.0
const CAMERA_AT := Vector3(0, 8, 16)  # from the own body

@onready var world: TesseraWorld = $World
@onready var camera: Camera3D = $Camera


func _ready() -> void:
	world.joined.connect(func(player: int, scene: String) -> void: print("player %d in %s" % [player, scene]))
	world.left.connect(func(reason: String) -> void: print("left: ", reason))
	world.body_entered.connect(func(id: int, _node: Node3D) -> void: print("body %d is here" % id))
	world.body_left.connect(func(id: int) -> void: print("body %d is gone" % id))
	world.game_event.connect(func(event: String, values: Dictionary) -> void: print(event, ": ", values))
	var arguments := OS.get_cmdline_user_args()
	if arguments.is_empty():
		print("usage: godot --path sample -- GRANT_FILE")
		return
	world.grant_file = arguments[0]
	world.join()


func _process(_seconds: float) -> void:
	var right := Input.get_axis("ui_left", "ui_right")
	var forward := Input.get_axis("ui_down", "ui_up")
	# Characters walk by the one, other bodies are pushed by the other.
	world.steer(Vector2(right, forward), 0.0, 0.0, 1 if Input.is_action_pressed("ui_accept") else 0)
	world.push(Vector3(right, 0, -forward) * FORCE_N, Vector3.ZERO)
	var own: Node3D = world.body_node(world.get_own_body())
	if own != null:
		camera.position = own.position + CAMERA_AT


func _unhandled_key_input(event: InputEvent) -> void:
	if event is InputEventKey and event.pressed and event.keycode == KEY_E:
		world.send("use")
