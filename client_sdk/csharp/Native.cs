// The C interface of libtessera-client, libtessera-connect and libtessera-local. Written by make_csharp.py from their headers.
using System;
using System.Runtime.InteropServices;

namespace Tessera {
  public enum Code {
    Ok = 0,
    InvalidArgument = 3,
    DeadlineExceeded = 4,
    NotFound = 5,
    AlreadyExists = 6,
    PermissionDenied = 7,
    ResourceExhausted = 8,
    FailedPrecondition = 9,
    Aborted = 10,
    Internal = 13,
    Unavailable = 14,
    DataLoss = 15,
    Unauthenticated = 16,
    NewGrantNeeded = 100,
  }

  public enum State {
    Joining = 0,
    Waiting = 1,
    Playing = 2,
    Ended = 3,
  }

  public enum EventKind {
    Appeared = 0,
    Vanished = 1,
    Started = 2,
    InputRefused = 3,
    RegionLost = 4,
    RegionBack = 5,
    MapChanged = 6,
    Ended = 7,
    ContactBegan = 8,
    ContactEnded = 9,
    TriggerEntered = 10,
    TriggerLeft = 11,
    RecordingEnded = 12,
    PropertyChanged = 13,
    ClockChanged = 14,
    CommandRefused = 15,
    GrantNeeded = 16,
    Restored = 17,
    WorldPropertyChanged = 18,
    PredictionCorrected = 19,
    MovementMissing = 20,
    SpawnTaken = 21,
    SpawnLost = 22,
    TileCame = 23,
    TileGone = 24,
  }

  public enum FieldType {
    Bool = 0,
    Int = 1,
    Real = 2,
    Text = 3,
    Vector = 4,
    Body = 5,
    Player = 6,
  }

  public enum PropertyType {
    Bool = 0,
    Int = 1,
    Real = 2,
    Text = 3,
    Vector = 4,
    Body = 5,
    Bytes = 6,
  }

  public enum ShapeKind {
    Box = 0,
    Sphere = 1,
    Capsule = 2,
    Cylinder = 3,
    Cone = 4,
    ConvexHull = 5,
    Compound = 6,
    Mesh = 7,
    HeightField = 8,
    Plane = 9,
  }

  public enum InstanceState {
    Waiting = 4,
    Running = 5,
    Ended = 8,
    Paused = 10,
  }

}

namespace Tessera.Native {
  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_grant_options {
    public uint size;
    public uint deadline_ms;
    public uint flags;
    public uint reserved;
    public byte* bind_address;
    public byte* scene_cache_dir;
    public void* scene;
    public UIntPtr scene_size;
    public IntPtr on_leave;
    public void* user;
    public IntPtr free_user;

    public static tessera_grant_options Initial {
      get {
        var one = new tessera_grant_options();
        one.size = (uint)sizeof(tessera_grant_options);
        one.deadline_ms = 10000;
        one.flags = Api.TESSERA_JOIN_PREDICT;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_event {
    public uint size;
    public EventKind kind;
    public ulong body;
    public uint region;
    public uint input;
    public byte* detail;
    public ulong other;
    public byte* property;
    public fixed double contact_point[3];
    public fixed double contact_normal[3];
    public double contact_impulse;
    public uint flags;
    public uint tile;

    public static tessera_event Initial {
      get {
        var one = new tessera_event();
        one.size = (uint)sizeof(tessera_event);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_spawn {
    public uint size;
    public uint flags;
    public byte* prefab;
    public fixed double position[3];
    public fixed double orientation[4];
    public fixed double velocity[3];
    public fixed double spin[3];

    public static tessera_spawn Initial {
      get {
        var one = new tessera_spawn();
        one.size = (uint)sizeof(tessera_spawn);
        one.orientation[3] = 1;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_game_event {
    public uint size;
    public byte* name;
    public UIntPtr field_count;

    public static tessera_game_event Initial {
      get {
        var one = new tessera_game_event();
        one.size = (uint)sizeof(tessera_game_event);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_game_event_field {
    public uint size;
    public FieldType type;
    public byte* name;
    public long integer;
    public double real;
    public fixed double vector[3];
    public byte* text;
    public UIntPtr text_size;

    public static tessera_game_event_field Initial {
      get {
        var one = new tessera_game_event_field();
        one.size = (uint)sizeof(tessera_game_event_field);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_body {
    public uint size;
    public uint region;
    public ulong id;
    public fixed double position[3];
    public fixed double orientation[4];
    public fixed float linear_velocity[3];
    public fixed float angular_velocity[3];
    public uint flags;

    public static tessera_body Initial {
      get {
        var one = new tessera_body();
        one.size = (uint)sizeof(tessera_body);
        one.orientation[3] = 1;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_property {
    public uint size;
    public PropertyType type;
    public long integer;
    public double real;
    public fixed byte text[(Api.TESSERA_MAX_PROPERTY_TEXT + 1)];
    public fixed double vector[3];
    public ulong body;
    public uint byte_count;
    public fixed byte bytes[Api.TESSERA_MAX_PROPERTY_BYTES];

    public static tessera_property Initial {
      get {
        var one = new tessera_property();
        one.size = (uint)sizeof(tessera_property);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_clock {
    public uint size;
    public int paused;
    public double ticks_per_second;

    public static tessera_clock Initial {
      get {
        var one = new tessera_clock();
        one.size = (uint)sizeof(tessera_clock);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_steering {
    public uint size;
    public uint buttons;
    public fixed float force[3];
    public fixed float torque[3];
    public fixed float move[2];
    public float yaw;
    public float pitch;

    public static tessera_steering Initial {
      get {
        var one = new tessera_steering();
        one.size = (uint)sizeof(tessera_steering);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_shape_info {
    public uint size;
    public ShapeKind kind;
    public fixed double dimensions[4];
    public float* vertices;
    public UIntPtr vertex_count;
    public uint* indices;
    public UIntPtr index_count;
    public uint columns;
    public uint rows;
    public double spacing;
    public UIntPtr child_count;

    public static tessera_shape_info Initial {
      get {
        var one = new tessera_shape_info();
        one.size = (uint)sizeof(tessera_shape_info);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_visual_info {
    public uint size;
    public uint mesh;
    public byte* sha256;
    public fixed double position[3];
    public fixed double orientation[4];
    public fixed double scale[3];

    public static tessera_visual_info Initial {
      get {
        var one = new tessera_visual_info();
        one.size = (uint)sizeof(tessera_visual_info);
        one.orientation[3] = 1;
        one.scale[0] = 1;
        one.scale[1] = 1;
        one.scale[2] = 1;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_body_info {
    public uint size;
    public int dynamic;
    public ulong id;
    public byte* name;
    public IntPtr shape;
    public double mass_kg;
    public int trigger;
    public fixed double position[3];
    public fixed double orientation[4];

    public static tessera_body_info Initial {
      get {
        var one = new tessera_body_info();
        one.size = (uint)sizeof(tessera_body_info);
        one.orientation[3] = 1;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_scene_info {
    public uint size;
    public uint tick_rate_hz;
    public byte* name;
    public fixed double bounds_min[3];
    public fixed double bounds_max[3];
    public fixed double gravity[3];
    public UIntPtr body_count;
    public double player_max_force_n;
    public double player_max_speed_m_s;
    public double character_walk_speed_m_s;
    public double character_run_speed_m_s;
    public UIntPtr tile_count;
    public double tile_edge;

    public static tessera_scene_info Initial {
      get {
        var one = new tessera_scene_info();
        one.size = (uint)sizeof(tessera_scene_info);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_tile_info {
    public uint size;
    public int here;
    public int row;
    public int column;
    public fixed double bounds_min[3];
    public fixed double bounds_max[3];
    public ulong bytes;
    public UIntPtr body_count;

    public static tessera_tile_info Initial {
      get {
        var one = new tessera_tile_info();
        one.size = (uint)sizeof(tessera_tile_info);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_duration {
    public ulong count;
    public double mean;
    public double p50;
    public double p99;
    public double max;
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_stats {
    public uint size;
    public uint regions_connected;
    public ulong bytes_in;
    public ulong bytes_out;
    public double bytes_in_per_s;
    public double bytes_out_per_s;
    public ulong datagrams_lost;
    public ulong decode_errors;
    public ulong full_records;
    public ulong delta_records;
    public ulong inputs_refused;
    public ulong bodies;
    public double round_trip_s;
    public double tick_rate_hz;
    public double render_delay_s;
    public double jitter_s;
    public ulong extrapolations;
    public ulong playout_jumps;
    public ulong reconnects;
    public int input_margin_ticks;
    public uint reserved;
    public ulong corrections;
    public double last_correction_m;
    public tessera_duration frame_time;
    public tessera_duration network_time;
    public tessera_duration update_time;
    public ulong datagrams_passed_over;
    public int predicting;
    public uint tiles;
    public ulong tile_bytes;
    public ulong tiles_damaged;

    public static tessera_stats Initial {
      get {
        var one = new tessera_stats();
        one.size = (uint)sizeof(tessera_stats);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_work {
    public ulong count;
    public double total;
    public double recent;
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_region_info {
    public uint size;
    public uint region;
    public int connected;
    public uint reports;
    public double round_trip_s;
    public ulong tick;
    public ulong bodies;
    public ulong ghosts;
    public ulong asleep;
    public ulong clients;
    public tessera_work step;
    public tessera_work physics;
    public tessera_work prediction;
    public tessera_work snapshot_full;
    public tessera_work snapshot_delta;
    public ulong process_virtual_bytes;
    public ulong process_physical_bytes;
    public ulong host_virtual_usable_bytes;
    public ulong host_virtual_total_bytes;
    public ulong host_physical_usable_bytes;
    public ulong host_physical_total_bytes;

    public static tessera_region_info Initial {
      get {
        var one = new tessera_region_info();
        one.size = (uint)sizeof(tessera_region_info);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_network {
    public uint size;
    public uint delay_ms;
    public uint jitter_ms;
    public double loss;
    public double duplicate;
    public ulong seed;

    public static tessera_network Initial {
      get {
        var one = new tessera_network();
        one.size = (uint)sizeof(tessera_network);
        one.seed = 1;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_instance_info {
    public uint size;
    public InstanceState state;
    public uint regions;
    public uint players;
    public uint expected_players;
    public uint name_count;
    public fixed byte id[64];
    public fixed byte scene[64];
    public fixed byte game[64];
    public fixed byte player_names[Api.TESSERA_MAX_LISTED_PLAYERS * (Api.TESSERA_MAX_LISTED_NAME + 1)];

    public static tessera_instance_info Initial {
      get {
        var one = new tessera_instance_info();
        one.size = (uint)sizeof(tessera_instance_info);
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_join_options {
    public uint size;
    public uint deadline_ms;
    public byte* control_address;
    public byte* instance_id;
    public byte* player_name;
    public byte* bind_address;
    public uint flags;
    public uint returning_size;
    public byte* returning;
    public byte* ticket;

    public static tessera_join_options Initial {
      get {
        var one = new tessera_join_options();
        one.size = (uint)sizeof(tessera_join_options);
        one.deadline_ms = 10000;
        one.flags = Api.TESSERA_JOIN_PREDICT;
        return one;
      }
    }
  }

  [StructLayout(LayoutKind.Sequential)]
  public unsafe struct tessera_local_options {
    public uint size;
    public uint snapshot_rate_hz;
    public byte* scene;
    public UIntPtr scene_size;
    public byte* scene_name;
    public byte* game;
    public UIntPtr game_size;
    public byte* game_name;
    public IntPtr movement;

    public static tessera_local_options Initial {
      get {
        var one = new tessera_local_options();
        one.size = (uint)sizeof(tessera_local_options);
        return one;
      }
    }
  }

  public static unsafe class Api {
    public const int TESSERA_VERSION_MAJOR = 0;
    public const int TESSERA_VERSION_MINOR = 1;
    public const int TESSERA_OK = 0;
    public const int TESSERA_INVALID_ARGUMENT = 3;
    public const int TESSERA_DEADLINE_EXCEEDED = 4;
    public const int TESSERA_NOT_FOUND = 5;
    public const int TESSERA_ALREADY_EXISTS = 6;
    public const int TESSERA_PERMISSION_DENIED = 7;
    public const int TESSERA_RESOURCE_EXHAUSTED = 8;
    public const int TESSERA_FAILED_PRECONDITION = 9;
    public const int TESSERA_ABORTED = 10;
    public const int TESSERA_INTERNAL = 13;
    public const int TESSERA_UNAVAILABLE = 14;
    public const int TESSERA_DATA_LOSS = 15;
    public const int TESSERA_UNAUTHENTICATED = 16;
    public const int TESSERA_NEW_GRANT_NEEDED = 100;
    public const int TESSERA_MAX_PLAYER_NAME = 32;
    public const int TESSERA_JOIN_PREDICT = 1;
    public const int TESSERA_JOIN_WATCH = 2;
    public const int TESSERA_MAX_GRANT = 1048576;
    public const int TESSERA_MAX_TOKEN = 1024;
    public const int TESSERA_JOINING = 0;
    public const int TESSERA_WAITING = 1;
    public const int TESSERA_PLAYING = 2;
    public const int TESSERA_ENDED = 3;
    public const int TESSERA_EVENT_APPEARED = 0;
    public const int TESSERA_EVENT_VANISHED = 1;
    public const int TESSERA_EVENT_STARTED = 2;
    public const int TESSERA_EVENT_INPUT_REFUSED = 3;
    public const int TESSERA_EVENT_REGION_LOST = 4;
    public const int TESSERA_EVENT_REGION_BACK = 5;
    public const int TESSERA_EVENT_MAP_CHANGED = 6;
    public const int TESSERA_EVENT_ENDED = 7;
    public const int TESSERA_EVENT_CONTACT_BEGAN = 8;
    public const int TESSERA_EVENT_CONTACT_ENDED = 9;
    public const int TESSERA_EVENT_TRIGGER_ENTERED = 10;
    public const int TESSERA_EVENT_TRIGGER_LEFT = 11;
    public const int TESSERA_EVENT_RECORDING_ENDED = 12;
    public const int TESSERA_EVENT_PROPERTY_CHANGED = 13;
    public const int TESSERA_EVENT_CLOCK_CHANGED = 14;
    public const int TESSERA_EVENT_COMMAND_REFUSED = 15;
    public const int TESSERA_EVENT_GRANT_NEEDED = 16;
    public const int TESSERA_EVENT_RESTORED = 17;
    public const int TESSERA_EVENT_WORLD_PROPERTY_CHANGED = 18;
    public const int TESSERA_EVENT_PREDICTION_CORRECTED = 19;
    public const int TESSERA_EVENT_MOVEMENT_MISSING = 20;
    public const int TESSERA_EVENT_SPAWN_TAKEN = 21;
    public const int TESSERA_EVENT_SPAWN_LOST = 22;
    public const int TESSERA_EVENT_TILE_CAME = 23;
    public const int TESSERA_EVENT_TILE_GONE = 24;
    public const int TESSERA_EVENT_SINCE_BEFORE = 1;
    public const int TESSERA_MAX_COMMAND = 1024;
    public const int TESSERA_SPAWN_FROM_OWN = 1;
    public const int TESSERA_MAX_PREDICTED_SPAWNS = 16;
    public const int TESSERA_FIELD_BOOL = 0;
    public const int TESSERA_FIELD_INT = 1;
    public const int TESSERA_FIELD_REAL = 2;
    public const int TESSERA_FIELD_TEXT = 3;
    public const int TESSERA_FIELD_VECTOR = 4;
    public const int TESSERA_FIELD_BODY = 5;
    public const int TESSERA_FIELD_PLAYER = 6;
    public const int TESSERA_BODY_ASLEEP = 1;
    public const int TESSERA_BODY_EXTRAPOLATED = 2;
    public const int TESSERA_BODY_OWN = 4;
    public const int TESSERA_BODY_PREDICTED = 8;
    public const int TESSERA_PROPERTY_BOOL = 0;
    public const int TESSERA_PROPERTY_INT = 1;
    public const int TESSERA_PROPERTY_REAL = 2;
    public const int TESSERA_PROPERTY_TEXT = 3;
    public const int TESSERA_PROPERTY_VECTOR = 4;
    public const int TESSERA_PROPERTY_BODY = 5;
    public const int TESSERA_PROPERTY_BYTES = 6;
    public const int TESSERA_MAX_PROPERTY_TEXT = 63;
    public const int TESSERA_MAX_PROPERTY_BYTES = 256;
    public const int TESSERA_SHAPE_BOX = 0;
    public const int TESSERA_SHAPE_SPHERE = 1;
    public const int TESSERA_SHAPE_CAPSULE = 2;
    public const int TESSERA_SHAPE_CYLINDER = 3;
    public const int TESSERA_SHAPE_CONE = 4;
    public const int TESSERA_SHAPE_CONVEX_HULL = 5;
    public const int TESSERA_SHAPE_COMPOUND = 6;
    public const int TESSERA_SHAPE_MESH = 7;
    public const int TESSERA_SHAPE_HEIGHT_FIELD = 8;
    public const int TESSERA_SHAPE_PLANE = 9;
    public const int TESSERA_INSTANCE_WAITING = 4;
    public const int TESSERA_INSTANCE_RUNNING = 5;
    public const int TESSERA_INSTANCE_ENDED = 8;
    public const int TESSERA_INSTANCE_PAUSED = 10;
    public const int TESSERA_MAX_LISTED_INSTANCES = 256;
    public const int TESSERA_MAX_LISTED_PLAYERS = 16;
    public const int TESSERA_MAX_LISTED_NAME = 63;
    public const int TESSERA_MAX_CONTROL_ADDRESSES = 16;

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_version();

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern byte* tessera_last_error();

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_set_last_error(Code code, byte* line);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern long tessera_now();

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_join_grant(void* grant, UIntPtr grant_size, tessera_grant_options* options, IntPtr* client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_renew(IntPtr client, void* grant, UIntPtr grant_size);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern UIntPtr tessera_return_token(IntPtr client, byte* token, UIntPtr capacity);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_leave(IntPtr client, uint deadline_ms);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern void tessera_close(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_poll(IntPtr client, long now_ns);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern State tessera_get_state(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern int tessera_next_event(IntPtr client, tessera_event* @event);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern UIntPtr tessera_disconnect_reason(IntPtr client, byte* reason, UIntPtr capacity);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_send(IntPtr client, void* bytes, UIntPtr size);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_predict_spawn(IntPtr client, tessera_spawn* spawn, void* command, UIntPtr command_size, ulong* body);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern int tessera_next_game_event(IntPtr client, tessera_game_event* @event);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_game_event_field_at(IntPtr client, UIntPtr index, tessera_game_event_field* field);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_find_game_event_field(IntPtr client, byte* name, tessera_game_event_field* field);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern UIntPtr tessera_player_name(IntPtr client, uint player, byte* name, UIntPtr capacity);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern int tessera_spectating(IntPtr client, double* view);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_record(IntPtr client, byte* file, ulong max_bytes);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_stop_recording(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_play(byte* file, IntPtr* client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern double tessera_recording_seconds(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_seek(IntPtr client, double seconds);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern UIntPtr tessera_bodies(IntPtr client, long now_ns, tessera_body* bodies, UIntPtr stride, UIntPtr capacity);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_find_body(IntPtr client, ulong id, tessera_body* body);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_property(IntPtr client, ulong body, byte* name, tessera_property* property);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_world_property(IntPtr client, byte* name, tessera_property* property);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_player(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern ulong tessera_own_body(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern ulong tessera_player_body(uint player);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_player_of_body(ulong body);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern ulong tessera_tick(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern ulong tessera_map_version(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_clock(IntPtr client, tessera_clock* clock);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_move(IntPtr client, float* force, float* torque);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_steer(IntPtr client, tessera_steering* steering);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_set_movement(IntPtr client, IntPtr movement);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern uint tessera_last_applied_input(IntPtr client);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_scene(IntPtr client, tessera_scene_info* scene);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_scene_body(IntPtr client, UIntPtr index, tessera_body_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_body_of(IntPtr client, ulong id, tessera_body_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_shape(IntPtr shape, tessera_shape_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_shape_child(IntPtr shape, UIntPtr index, IntPtr* child, double* position, double* orientation);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_shape_visual(IntPtr shape, UIntPtr index, tessera_visual_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_tile(IntPtr client, uint tile, tessera_tile_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_tile_body(IntPtr client, uint tile, UIntPtr index, tessera_body_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_view_tiles(IntPtr client, double* centre, double radius);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_stats(IntPtr client, tessera_stats* stats);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_region_stats(IntPtr client, UIntPtr index, tessera_region_info* info);

    [DllImport("tessera-client", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_simulate_network(IntPtr client, tessera_network* network);

    [DllImport("tessera-connect", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_list_instances(byte* control_address, uint deadline_ms, tessera_instance_info* instances, UIntPtr stride, UIntPtr capacity, UIntPtr* count);

    [DllImport("tessera-connect", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_join(tessera_join_options* options, IntPtr* client);

    [DllImport("tessera-connect", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_get_grant(tessera_join_options* options, void* grant, UIntPtr capacity, UIntPtr* size);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_local_world(tessera_local_options* options, IntPtr* world);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_local_advance(IntPtr world, long now_ns);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern Code tessera_local_join(IntPtr world, tessera_grant_options* options, IntPtr* client);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern ulong tessera_local_tick(IntPtr world);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern byte* tessera_local_line(IntPtr world);

    [DllImport("tessera-local", CallingConvention = CallingConvention.Cdecl)]
    public static extern void tessera_local_close(IntPtr world);
  }
}
