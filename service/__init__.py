"""What a scene means: documents, assets, jobs, routes and the command line. No GL call is made here.

app                what is served: the routes and the editor's files
cli                the command line; `commands` has a module for each command
config             every limit, and the SUNBOX_* variables that set it
problems           the errors that callers see, with their HTTP statuses
scene              the document as a person writes it
pack               a document -> the renderer's arrays
assets             meshes and images that scenes refer to
images             pixels -> files
presets            built-in scenes, materials and environments
views              the names of AOVs and tone maps
quality            quality presets, and settings with every knob resolved
recipe             what a picture was made from, in its metadata
rendering          what is wanted of the renderer, and the process that owns the GPU
routes             the endpoints
bodies             JSON bodies, taken in and parsed
state              what the routes share
traffic            requests, counted and timed
metrics            /metrics
readiness          whether a picture can be rendered now
guard              who may ask, from which hosts and pages
keys               whose key somebody shows
connections        connections below HTTP
connection_limits  how many connections there are, and how long one may stand still
downloads          large answers, in pieces
documents          what users saved, in SQLite
database           the SQLite file: its version, its connections
migrations         its tables, as the ordered steps that made them
data_lock          one server at a time on a data folder
memory             one budget of memory for all work
shares             what each caller has of something that all of them share
turns              whom the work at hand is for, and turns that go round these callers
quota              room on the disk
lost_pictures      pictures of renders that the database does not know
asset_shares       what the assets of one key take
asset_access       which assets a key may use
disk_usage         what files take on a disk: blocks and inodes
garbage            the garbage collector, out of the way of large imports
storage            what is kept in the data folder
data_check         whether that is sound
logs               a line or a JSON object for each event
log_output         where log records go
child_processes    children that parse strangers' files, as the service starts and ends them; what children inherit
confined           what such a child gives up before it reads anything
cpu_time           how long a process was able to run
shared_memory      arrays that another process may map
commands           the commands
bench              measurements of the product
"""
