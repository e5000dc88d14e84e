// World: a player's way into a running world, over the C interface in Native.cs.
//
//   using (var world = World.Join(grant, new JoinOptions { SceneCacheFolder = "cache" })) {
//     while (running && !world.Ended) {                       // once a frame
//       world.Poll();
//       foreach (Event one in world.TakeEvents()) ...
//       world.Move(force);
//       foreach (Body body in world.Bodies()) Draw(body.Id, body.Position, body.Orientation);
//     }
//     world.Leave();
//   }
//
// Promises: a call that the library refuses throws TesseraException with the library's line. Nothing waits but Leave,
// up to its deadline. Dispose closes the connections; without Leave before it the player can come back.
// Thread rule: one thread at a time a world; no callback comes from another thread.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Tessera.Native;

namespace Tessera {
  public sealed class JoinOptions {
    public string SceneCacheFolder;  // null: scenes are kept nowhere
    public string BindAddress;       // IPv4 of the local socket; null: any
    public uint DeadlineMs = 10000;  // until all regions have answered
    public bool Predict = true;      // show the own body ahead, by the inputs already made
    // Called by Leave with the return token and the deadline in milliseconds, so that whoever gave the grant lets the
    // player go. An exception of it counts as Code.Internal. null: nobody is asked, and the player can come back.
    public Func<byte[], uint, Code> OnLeave;
  }

  public sealed unsafe class World : IDisposable {
    [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
    private delegate Code LeaveCallback(void* user, byte* token, UIntPtr token_size, uint deadline_ms);

    internal delegate Code Joiner(tessera_grant_options* options, IntPtr* client);

    private IntPtr client_;
    private Body[] bodies_ = new Body[64];
    private readonly LeaveCallback on_leave_;  // the library calls it, so it stays as long as the world does

    private World(IntPtr client, LeaveCallback on_leave) { client_ = client; on_leave_ = on_leave; }

    // Does not wait: the world is State.Joining until its regions have answered and the scene is here.
    public static World Join(byte[] grant, JoinOptions options = null) {
      if (grant == null) throw new ArgumentNullException(nameof(grant));
      fixed (byte* bytes = grant) {
        void* begin = bytes;
        return Join((native, client) => Api.tessera_join_grant(begin, (UIntPtr)grant.Length, native, client), options);
      }
    }

    // A recording, as if it were played again now; it ends with the file.
    public static World Play(string file) {
      IntPtr client;
      fixed (byte* name = Utf8.Bytes(file)) TesseraException.Check(Api.tessera_play(name, &client));
      return new World(client, null);
    }

    internal static World Join(Joiner join, JoinOptions options) {
      options = options ?? new JoinOptions();
      var native = tessera_grant_options.Initial;
      native.deadline_ms = options.DeadlineMs;
      native.flags = options.Predict ? (uint)Api.TESSERA_JOIN_PREDICT : 0;
      LeaveCallback on_leave = null;
      if (options.OnLeave != null) {
        var asked = options.OnLeave;
        on_leave = (user, token, size, deadline) => {
          try {
            return asked(new ReadOnlySpan<byte>(token, checked((int)size)).ToArray(), deadline);
          } catch (Exception) {
            return Code.Internal;  // none may pass through the library
          }
        };
        native.on_leave = Marshal.GetFunctionPointerForDelegate(on_leave);
      }
      IntPtr client;
      fixed (byte* folder = Utf8.Bytes(options.SceneCacheFolder), address = Utf8.Bytes(options.BindAddress)) {
        native.scene_cache_dir = folder;
        native.bind_address = address;
        TesseraException.Check(join(&native, &client));
      }
      return new World(client, on_leave);
    }

    private IntPtr Client => client_ != IntPtr.Zero ? client_ : throw new ObjectDisposedException(nameof(World));

    public void Dispose() {
      Api.tessera_close(client_);
      client_ = IntPtr.Zero;
      GC.KeepAlive(on_leave_);
    }

    // Nanoseconds of a clock that never goes back. Calls that take a time may be given a clock of the game's own.
    public static long Now => Api.tessera_now();
    public static uint LibraryVersion => Api.tessera_version();

    // --- Once a frame ---

    // At least 30 times a second. Throws when the client has ended for a reason that is an error.
    public void Poll() => Poll(Now);
    public void Poll(long now_ns) => TesseraException.Check(Api.tessera_poll(Client, now_ns));

    public State State => Api.tessera_get_state(Client);
    public bool Ended => State == State.Ended;

    public List<Event> TakeEvents() {
      var events = new List<Event>();
      var one = tessera_event.Initial;
      while (Api.tessera_next_event(Client, &one) != 0) events.Add(new Event(&one));
      return events;
    }

    public List<GameEvent> TakeGameEvents() {
      var events = new List<GameEvent>();
      var one = tessera_game_event.Initial;
      while (Api.tessera_next_game_event(Client, &one) != 0) {
        var values = new Dictionary<string, object>();
        for (ulong at = 0; at < (ulong)one.field_count; ++at) {
          var field = tessera_game_event_field.Initial;
          TesseraException.Check(Api.tessera_game_event_field_at(Client, (UIntPtr)at, &field));
          values[Utf8.Read(field.name)] = GameEvent.ValueOf(&field);
        }
        events.Add(new GameEvent(Utf8.Read(one.name), values));
      }
      return events;
    }

    // All bodies as they are to be drawn now, ascending by id; valid until the next call.
    public ReadOnlySpan<Body> Bodies() => Bodies(Now);
    public ReadOnlySpan<Body> Bodies(long now_ns) {
      while (true) {
        int count;
        fixed (Body* first = bodies_) {
          count = checked((int)Api.tessera_bodies(Client, now_ns, (tessera_body*)first, (UIntPtr)sizeof(tessera_body),
                                                  (UIntPtr)bodies_.Length));
        }
        if (count <= bodies_.Length) return new ReadOnlySpan<Body>(bodies_, 0, count);
        bodies_ = new Body[count + count / 2];
      }
    }

    // The newest state known of one body; false if it is not in sight.
    public bool Find(ulong id, out Body body) {
      body = new Body { native = tessera_body.Initial };
      fixed (Body* at = &body) return Api.tessera_find_body(Client, id, (tessera_body*)at) == Code.Ok;
    }

    // --- What the player does ---

    // Force (N) and torque (N m) on the own body, until the next call. Gives the number of the next input.
    public uint Move(Vector3d force, Vector3d torque = default(Vector3d)) {
      float* pushed = stackalloc float[3], turned = stackalloc float[3];
      force.WriteTo(pushed);
      torque.WriteTo(turned);
      return Api.tessera_move(Client, pushed, turned);
    }

    // For a character: right and forward, where the player looks, and bit i of `buttons` while button i is held.
    public uint Steer(float right, float forward, float yaw, float pitch, uint buttons = 0) {
      var steering = tessera_steering.Initial;
      steering.move[0] = right;
      steering.move[1] = forward;
      steering.yaw = yaw;
      steering.pitch = pitch;
      steering.buttons = buttons;
      return Api.tessera_steer(Client, &steering);
    }

    // Asks something of the game, which gets it exactly once, after all that was sent before it.
    public void Send(string command) => Send(System.Text.Encoding.UTF8.GetBytes(command));
    public void Send(ReadOnlySpan<byte> command) {
      byte none;
      fixed (byte* first = &MemoryMarshal.GetReference(command)) {
        byte* bytes = first == null ? &none : first;
        TesseraException.Check(Api.tessera_send(Client, bytes, (UIntPtr)command.Length));
      }
    }

    // Goes on by a newer grant for the same player, after EventKind.GrantNeeded or at any time before.
    public void Renew(byte[] grant) {
      fixed (byte* bytes = grant) {
        TesseraException.Check(Api.tessera_renew(Client, bytes, (UIntPtr)(grant?.Length ?? 0)));
      }
    }

    // Ends. Throws where whoever lets the player go was not heard of; the world has ended all the same.
    public void Leave(uint deadline_ms = 2000) => TesseraException.Check(Api.tessera_leave(Client, deadline_ms));

    // --- What is known ---

    public uint Player => Api.tessera_player(Client);
    public ulong OwnBody => Api.tessera_own_body(Client);
    public ulong Tick => Api.tessera_tick(Client);

    public string SceneName {
      get {
        var scene = tessera_scene_info.Initial;
        TesseraException.Check(Api.tessera_get_scene(Client, &scene));
        return Utf8.Read(scene.name);
      }
    }

    // A property of a body, or of the world, by its name: a bool, long, double, string, Vector3d, BodyId or byte[].
    // null: there is none of that name.
    public object PropertyOf(ulong body, string name) {
      var value = tessera_property.Initial;
      fixed (byte* text = Utf8.Bytes(name)) return Found(Api.tessera_get_property(Client, body, text, &value), &value);
    }
    public object WorldProperty(string name) {
      var value = tessera_property.Initial;
      fixed (byte* text = Utf8.Bytes(name)) return Found(Api.tessera_get_world_property(Client, text, &value), &value);
    }

    public string NameOf(uint player) {
      byte* name = stackalloc byte[Api.TESSERA_MAX_PLAYER_NAME + 1];
      var size = (int)Api.tessera_player_name(Client, player, name, (UIntPtr)(Api.TESSERA_MAX_PLAYER_NAME + 1));
      return Utf8.Read(name, size);
    }

    // Why the client has ended, the game's own words where it sent the player away; empty while it has not.
    public string DisconnectReason {
      get {
        var reason = new byte[(int)Api.tessera_disconnect_reason(Client, null, UIntPtr.Zero) + 1];
        fixed (byte* first = reason) {
          Api.tessera_disconnect_reason(Client, first, (UIntPtr)reason.Length);
          return Utf8.Read(first);
        }
      }
    }

    // Makes its holder this player until the player leaves: secret. Empty for a viewer.
    public byte[] ReturnToken() {
      byte* token = stackalloc byte[Api.TESSERA_MAX_TOKEN];
      var size = (int)Api.tessera_return_token(Client, token, (UIntPtr)Api.TESSERA_MAX_TOKEN);
      return new ReadOnlySpan<byte>(token, size).ToArray();
    }

    public tessera_stats Stats() {
      var stats = tessera_stats.Initial;
      TesseraException.Check(Api.tessera_get_stats(Client, &stats));
      return stats;
    }

    // The handle, for all of Api that has no method here: recordings, the scene's shapes, a bad network.
    public IntPtr Handle => Client;

    private static object Found(Code code, tessera_property* value) {
      if (code == Code.NotFound) return null;
      TesseraException.Check(code);
      switch (value->type) {
        case PropertyType.Bool: return value->integer != 0;
        case PropertyType.Int: return value->integer;
        case PropertyType.Real: return value->real;
        case PropertyType.Text: return Utf8.Read(value->text);
        case PropertyType.Vector: return new Vector3d(value->vector);
        case PropertyType.Body: return new BodyId(value->body);
        case PropertyType.Bytes: return new ReadOnlySpan<byte>(value->bytes, (int)value->byte_count).ToArray();
        default: return null;  // of a newer library
      }
    }
  }
}
