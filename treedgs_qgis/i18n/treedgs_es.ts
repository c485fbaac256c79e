<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="es" sourcelanguage="en">
  <context>
    <name>TreeDGS</name>
    <message>
      <source>Trees</source>
      <translation>Árboles</translation>
    </message>
    <message>
      <source>Change</source>
      <translation>Cambio</translation>
    </message>
    <message>
      <source>Camera stations</source>
      <translation>Estaciones de cámara</translation>
    </message>
    <message>
      <source>Pairs</source>
      <translation>Pares</translation>
    </message>
    <message>
      <source>PHOTOS: {folder} holds {found} photos, expected at least {least} (better 40 or more) as {kinds}.</source>
      <translation>PHOTOS: {folder} contiene {found} fotos, se esperan al menos {least} (mejor 40 o más) como {kinds}.</translation>
    </message>
    <message>
      <source>Flight plan</source>
      <translation>Plan de vuelo</translation>
    </message>
    <message>
      <source>Plots; and what stands there, as a layer (with trees also the crown base) or in numbers</source>
      <translation>parcelas; y lo que hay en ellas, como capa (con árboles también la base de copa) o en números</translation>
    </message>
    <message>
      <source>INPUT: {path} is not a LAS or LAZ file; convert the cloud to LAZ first.</source>
      <translation>INPUT: {path} no es un archivo LAS ni LAZ; convierta antes la nube a LAZ.</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Remove the engine: its libraries, and the Python that was fetched for it.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Do this before you uninstall the plugin, which QGIS removes without it. Engines of former versions go too. Your
results, workspaces and the logs of former jobs stay (these only if you do not tick them), and so does an engine that
the plugin in another QGIS profile uses. &lt;b&gt;Set up the engine&lt;/b&gt; brings it back.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Quita el motor: sus bibliotecas y el Python que se bajó para él.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Hágalo antes de desinstalar el complemento, que QGIS quita sin él. Los motores de versiones anteriores también se
van. Sus resultados, carpetas de trabajo y los registros de trabajos anteriores quedan (estos solo si no los marca),
y también un motor que usa el complemento en otro perfil de QGIS. &lt;b&gt;Instalar el motor&lt;/b&gt; lo trae de nuevo.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Remove the engine</source>
      <translation>Quitar el motor</translation>
    </message>
    <message>
      <source>Setup</source>
      <translation>Instalación</translation>
    </message>
    <message>
      <source>Free the disk that the engine takes.</source>
      <translation>Libera el disco que ocupa el motor.</translation>
    </message>
    <message>
      <source>Removed from {folder}: {size} are free again.</source>
      <translation>Quitado de {folder}: {size} quedan libres.</translation>
    </message>
    <message>
      <source>Logs of former jobs too</source>
      <translation>También los registros de trabajos anteriores</translation>
    </message>
    <message>
      <source>The logs of the last 20 jobs; results lie where you wrote them and always stay.</source>
      <translation>Los registros de los últimos 20 trabajos; los resultados están donde usted los escribió y siempre quedan.</translation>
    </message>
    <message>
      <source>{folder} stays: the plugin in {plugin} uses it; run this there too if it is not needed.</source>
      <translation>{folder} queda: lo usa el complemento en {plugin}; ejecute esto también allí si no hace falta.</translation>
    </message>
    <message>
      <source>Disk that became free, GB</source>
      <translation>Disco liberado, GB</translation>
    </message>
    <message>
      <source>{folder} is in use and was not removed; let its jobs end, or stop them, and run this again.</source>
      <translation>{folder} está en uso y no se quitó; deje terminar sus trabajos o deténgalos, y ejecute esto otra vez.</translation>
    </message>
    <message>
      <source>TREES: the layer '{layer}' is filtered or no file; remove the filter, or give its file.</source>
      <translation>TREES: la capa '{layer}' está filtrada o no es un archivo; quite el filtro o indique su archivo.</translation>
    </message>
    <message>
      <source>Review trees</source>
      <translation>Revisar árboles</translation>
    </message>
    <message>
      <source>3 Check</source>
      <translation>3 Comprobar</translation>
    </message>
    <message>
      <source>Open the panel in which a person decides about trees on the map.</source>
      <translation>Abrir el panel en el que una persona decide sobre los árboles en el mapa.</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Copy the sample flight: photos of a small simulated plot, with geotags, terrain and field table.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Then run &lt;b&gt;Measure DBH from drone photos&lt;/b&gt; on it; &lt;i&gt;Plugins ▸ TreeDGS ▸ Try it with a sample flight&lt;/i&gt; opens
that with everything filled in. The photos are rendered, not taken: their trees are easier than yours.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Copiar el vuelo de ejemplo: fotos de una pequeña parcela simulada, con geoetiquetas, terreno y tabla de campo.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Después ejecute &lt;b&gt;Medir el DAP en fotos de dron&lt;/b&gt; con él; &lt;i&gt;Complementos ▸ TreeDGS ▸ Probar con un vuelo de ejemplo&lt;/i&gt; lo abre con todo rellenado. Las fotos son sintéticas, no tomadas: sus árboles son más fáciles que los suyos.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Get the sample flight</source>
      <translation>Obtener el vuelo de ejemplo</translation>
    </message>
    <message>
      <source>Get a small flight to try the plugin with.</source>
      <translation>Obtiene un vuelo pequeño para probar el complemento.</translation>
    </message>
    <message>
      <source>Copy into</source>
      <translation>Copiar en</translation>
    </message>
    <message>
      <source>Left empty: into the plugin's data folder.</source>
      <translation>Vacío: en la carpeta de datos del complemento.</translation>
    </message>
    <message>
      <source>The flight's folder</source>
      <translation>Carpeta del vuelo</translation>
    </message>
    <message>
      <source>Its coordinate reference system</source>
      <translation>Su sistema de referencia de coordenadas</translation>
    </message>
    <message>
      <source>The sample flight is there: {folder}</source>
      <translation>El vuelo de ejemplo está en {folder}</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Install the libraries that the TreeDGS algorithms need, in an environment of their own.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Makes a Python environment in your data folder (or in TREEDGS_HOME; {takes} at 50 Mbit/s), and installs the locked
list of libraries with pip. QGIS and its Python are not touched. Python 3.10 to 3.14 with venv is found on this
computer, or fetched for the engine alone. It needs the network or a folder of wheels. In the end the parts of TreeDGS
that compute most are compiled for this processor, so that the first job does not wait for it. What was cut short is
taken up by running it again. Engines of former versions are removed in the end; jobs and results stay. &lt;b&gt;Remove the
engine&lt;/b&gt; frees the disk.&lt;/p&gt;
&lt;p&gt;Parts that not everybody needs are ticked; run it again to add one. What is there stays, unless you start from
scratch.&lt;/p&gt;
&lt;p&gt;On a machine with &lt;code&gt;make&lt;/code&gt;, &lt;code&gt;make setup&lt;/code&gt; does the same for the repository.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Instala las bibliotecas que necesitan los algoritmos de TreeDGS, en un entorno propio.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Crea un entorno de Python en su carpeta de datos (o en TREEDGS_HOME; {takes} a 50 Mbit/s) e instala con pip la lista fijada de
bibliotecas. QGIS y su Python no se tocan. Se busca en este ordenador un Python 3.10 a 3.14 con venv, o se baja uno solo para
el motor. Necesita la red o una carpeta de wheels. Al final se compilan para este
procesador las partes de TreeDGS que más calculan, para que el primer trabajo no tenga que esperar. Lo que se interrumpió sigue al ejecutarlo otra vez. Los motores de versiones
anteriores se quitan al final; trabajos y resultados quedan. &lt;b&gt;Quitar el motor&lt;/b&gt; libera el disco.&lt;/p&gt;
&lt;p&gt;Las partes que no todos necesitan se marcan; ejecútelo otra vez para añadir una. Lo que hay queda, salvo que empiece desde
cero.&lt;/p&gt;
&lt;p&gt;En una máquina con &lt;code&gt;make&lt;/code&gt;, &lt;code&gt;make setup&lt;/code&gt; hace lo mismo para el repositorio.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Set up the engine</source>
      <translation>Instalar el motor</translation>
    </message>
    <message>
      <source>Install the engine's libraries in an environment of their own.</source>
      <translation>Instala las bibliotecas del motor en un entorno propio.</translation>
    </message>
    <message>
      <source>Compiling for this processor, once, so that the first job is quick</source>
      <translation>Compilando para este procesador, una vez, para que el primer trabajo sea rápido</translation>
    </message>
    <message>
      <source>{count} functions compiled in {time}.</source>
      <translation>{count} funciones compiladas en {time}.</translation>
    </message>
    <message>
      <source>Python to build with</source>
      <translation>Python para la instalación</translation>
    </message>
    <message>
      <source>A Python 3.10 to 3.14 with venv; left empty, the system's is found.</source>
      <translation>Un Python 3.10 a 3.14 con venv; si se deja vacío, se busca el del sistema.</translation>
    </message>
    <message>
      <source>Folder of wheels (no network)</source>
      <translation>Carpeta de wheels (sin red)</translation>
    </message>
    <message>
      <source>A folder of .whl files, made on another machine with: pip download --require-hashes -r requirements-locked.txt -d FOLDER.</source>
      <translation>Una carpeta de archivos .whl, hecha en otro equipo con: pip download --require-hashes -r requirements-locked.txt -d CARPETA.</translation>
    </message>
    <message>
      <source>For which processor</source>
      <translation>Para qué procesador</translation>
    </message>
    <message>
      <source>auto: with NVIDIA's library where a card and driver are found that it can use; cpu: without; cuda: with it in any case. Only Gaussians that are fitted with the device cuda use the card.</source>
      <translation>auto: con la biblioteca de NVIDIA donde se halle una tarjeta y un controlador que pueda usar; cpu: sin ella; cuda: con ella en todo caso. Solo las gaussianas que se ajustan con el dispositivo cuda usan la tarjeta.</translation>
    </message>
    <message>
      <source>Start from scratch</source>
      <translation>Empezar de cero</translation>
    </message>
    <message>
      <source>Remove the environment first, to repair a broken one.</source>
      <translation>Quitar antes el entorno, para reparar uno dañado.</translation>
    </message>
    <message>
      <source>Compile for this processor</source>
      <translation>Compilar para este procesador</translation>
    </message>
    <message>
      <source>The first job does not wait for it then; without it the first job compiles.</source>
      <translation>El primer trabajo no espera entonces; sin esto compila el primer trabajo.</translation>
    </message>
    <message>
      <source>WHEELS: {folder} is not a folder; give the folder that holds the .whl files.</source>
      <translation>WHEELS: {folder} no es una carpeta; dé la carpeta que contiene los archivos .whl.</translation>
    </message>
    <message>
      <source>WHEELS: {folder}: holds no .whl files, expected the wheels of the engine's libraries.</source>
      <translation>WHEELS: {folder}: no contiene archivos .whl, se esperan los wheels de las bibliotecas del motor.</translation>
    </message>
    <message>
      <source>PYTHON: {path} does not exist; give a Python program or leave it empty.</source>
      <translation>PYTHON: {path} no existe; dé un programa Python o déjelo vacío.</translation>
    </message>
    <message>
      <source>Engines of former versions and downloads are removed: {size} free again.</source>
      <translation>Motores de versiones anteriores y descargas quitados: {size} libres otra vez.</translation>
    </message>
    <message>
      <source>{folder}, the engine of a former version, is in use and stays until the next set-up.</source>
      <translation>{folder}, el motor de una versión anterior, está en uso y queda hasta la próxima instalación.</translation>
    </message>
    <message>
      <source>Measuring trees from photos and clouds does not need it; it can be added later.</source>
      <translation>No hace falta para medir árboles en fotos y nubes de puntos; se puede añadir después.</translation>
    </message>
    <message>
      <source>The engine's Python</source>
      <translation>Python del motor</translation>
    </message>
    <message>
      <source>The engine will use the graphics card: {why}.</source>
      <translation>El motor usará la tarjeta gráfica: {why}.</translation>
    </message>
    <message>
      <source>The engine will use the processor only: {why}.</source>
      <translation>El motor usará solo el procesador: {why}.</translation>
    </message>
    <message>
      <source>The engine is set up, but it could not compile ahead; the first job will: {why}</source>
      <translation>El motor está instalado, pero no pudo compilar por adelantado; lo hará el primer trabajo: {why}</translation>
    </message>
    <message>
      <source>Stopped; run it again to go on where it ended.</source>
      <translation>Detenido; ejecútelo otra vez para seguir donde quedó.</translation>
    </message>
    <message>
      <source>The QGIS setting treedgs/python still names {path} and comes first; clear it to use the environment that was just built.</source>
      <translation>El ajuste de QGIS treedgs/python aún nombra {path} y tiene prioridad; bórrelo para usar el entorno recién creado.</translation>
    </message>
    <message>
      <source>the locked list of libraries</source>
      <translation>la lista fijada de bibliotecas</translation>
    </message>
    <message>
      <source>Trees and plots, or pairs</source>
      <translation>árboles y parcelas, o pares</translation>
    </message>
    <message>
      <source>Tape check</source>
      <translation>Comprobación con cinta</translation>
    </message>
    <message>
      <source>Trees to tape</source>
      <translation>Árboles que medir con cinta</translation>
    </message>
    <message>
      <source>Terrain model</source>
      <translation>Modelo del terreno</translation>
    </message>
    <message>
      <source>Tree</source>
      <translation>Árbol</translation>
    </message>
    <message>
      <source>growth</source>
      <translation>crecimiento</translation>
    </message>
    <message>
      <source>yaw</source>
      <translation>rumbo</translation>
    </message>
    <message>
      <source>pitch</source>
      <translation>cabeceo</translation>
    </message>
    <message>
      <source>Field tree</source>
      <translation>Árbol de campo</translation>
    </message>
    <message>
      <source>measured tree</source>
      <translation>árbol medido</translation>
    </message>
    <message>
      <source>field</source>
      <translation>campo</translation>
    </message>
    <message>
      <source>measured</source>
      <translation>medido</translation>
    </message>
    <message>
      <source>distance</source>
      <translation>distancia</translation>
    </message>
    <message>
      <source>Plot</source>
      <translation>Parcela</translation>
    </message>
    <message>
      <source>field trees paired</source>
      <translation>árboles de campo emparejados</translation>
    </message>
    <message>
      <source>moved east, north</source>
      <translation>movida al este, norte</translation>
    </message>
    <message>
      <source>turned</source>
      <translation>girada</translation>
    </message>
    <message>
      <source>rejected</source>
      <translation>rechazado</translation>
    </message>
    <message>
      <source>no DBH</source>
      <translation>sin DAP</translation>
    </message>
    <message>
      <source>Photo</source>
      <translation>Foto</translation>
    </message>
    <message>
      <source>over the take-off</source>
      <translation>sobre el despegue</translation>
    </message>
    <message>
      <source>over the ground</source>
      <translation>sobre el suelo</translation>
    </message>
    <message>
      <source>expected</source>
      <translation>esperado</translation>
    </message>
    <message>
      <source>clear views a stem</source>
      <translation>vistas libres por fuste</translation>
    </message>
    <message>
      <source>trees</source>
      <translation>árboles</translation>
    </message>
    <message>
      <source>without a DBH</source>
      <translation>sin DAP</translation>
    </message>
    <message>
      <source>trees/ha</source>
      <translation>árboles/ha</translation>
    </message>
    <message>
      <source>plot</source>
      <translation>parcela</translation>
    </message>
    <message>
      <source>DBH</source>
      <translation>DAP</translation>
    </message>
    <message>
      <source>height</source>
      <translation>altura</translation>
    </message>
    <message>
      <source>counts as</source>
      <translation>cuenta como</translation>
    </message>
    <message>
      <source>taped</source>
      <translation>medido con cinta</translation>
    </message>
    <message>
      <source>accepted</source>
      <translation>aceptado</translation>
    </message>
    <message>
      <source>no tree stands here</source>
      <translation>aquí no hay árbol</translation>
    </message>
    <message>
      <source>the same tree as another</source>
      <translation>el mismo árbol que otro</translation>
    </message>
    <message>
      <source>a stem stands here, DBH unknown</source>
      <translation>aquí hay un fuste, DAP desconocido</translation>
    </message>
    <message>
      <source>drawn at true scale</source>
      <translation>dibujado a escala real</translation>
    </message>
    <message>
      <source>Crown of tree</source>
      <translation>Copa del árbol</translation>
    </message>
    <message>
      <source>searched</source>
      <translation>buscado</translation>
    </message>
    <message>
      <source>at</source>
      <translation>a</translation>
    </message>
    <message>
      <source>points round</source>
      <translation>puntos alrededor de</translation>
    </message>
    <message>
      <source>No DBH</source>
      <translation>Sin DAP</translation>
    </message>
    <message>
      <source>Parameter {name} is unknown to {algorithm}; {hint}</source>
      <translation>{algorithm} no conoce el parámetro {name}; {hint}</translation>
    </message>
    <message>
      <source>The rest can stay as it is.</source>
      <translation>Lo demás puede quedar como está.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected one of {choices}.</source>
      <translation>{name}: se encontró '{given}', se espera uno de {choices}.</translation>
    </message>
    <message>
      <source>{names}: lies in a temporary folder, which QGIS deletes when it is closed; save it elsewhere.</source>
      <translation>{names}: está en una carpeta temporal, que QGIS borra al cerrarse; guárdelo en otro lugar.</translation>
    </message>
    <message>
      <source>Parameters</source>
      <translation>Parámetros</translation>
    </message>
    <message>
      <source>Advanced parameters</source>
      <translation>Parámetros avanzados</translation>
    </message>
    <message>
      <source>On the command line:</source>
      <translation>En la línea de órdenes:</translation>
    </message>
    <message>
      <source>Done in {time}.</source>
      <translation>Terminado en {time}.</translation>
    </message>
    <message>
      <source>did you mean {name}?</source>
      <translation>¿quiso decir {name}?</translation>
    </message>
    <message>
      <source>known: {names}.</source>
      <translation>conocidos: {names}.</translation>
    </message>
    <message>
      <source>You need: {names}.</source>
      <translation>Hace falta: {names}.</translation>
    </message>
    <message>
      <source>Give if you have them: {names}.</source>
      <translation>Indique, si los tiene: {names}.</translation>
    </message>
    <message>
      <source>Results</source>
      <translation>Resultados</translation>
    </message>
    <message>
      <source>{name} is required: {help}</source>
      <translation>{name} es obligatorio: {help}</translation>
    </message>
    <message>
      <source>{done} of {all} stems measured.</source>
      <translation>{done} de {all} troncos medidos.</translation>
    </message>
    <message>
      <source>{name} is required: give a projected CRS in metres, like {zone}.</source>
      <translation>{name} es obligatorio: dé un SRC proyectado en metros, como {zone}.</translation>
    </message>
    <message>
      <source>{name}: '{given}' is not a coordinate reference system; give one like {zone}.</source>
      <translation>{name}: '{given}' no es un sistema de referencia de coordenadas; dé uno como {zone}.</translation>
    </message>
    <message>
      <source>{name}: {crs} is not in metres; choose the metric version of this CRS or the UTM zone.</source>
      <translation>{name}: {crs} no está en metros; elija la versión métrica de este SRC o la zona UTM.</translation>
    </message>
    <message>
      <source>the photos in {folder}</source>
      <translation>las fotos de {folder}</translation>
    </message>
    <message>
      <source>DTM: {dtm} covers x {west} to {east}, y {south} to {north}, but {what} lies at x {x}, y {y} ({crs}); give the terrain model of this place.</source>
      <translation>DTM: {dtm} cubre x de {west} a {east}, y de {south} a {north}, pero {what} está en x {x}, y {y} ({crs}); dé el modelo del terreno de este lugar.</translation>
    </message>
    <message>
      <source>{name}: {path} does not exist; give a file that does.</source>
      <translation>{name}: {path} no existe; dé un archivo que exista.</translation>
    </message>
    <message>
      <source>{name}: {path} is a folder, expected a file.</source>
      <translation>{name}: {path} es una carpeta, se espera un archivo.</translation>
    </message>
    <message>
      <source>{name}: {path} is a file, expected a folder.</source>
      <translation>{name}: {path} es un archivo, se espera una carpeta.</translation>
    </message>
    <message>
      <source>{name}: a layer in memory cannot be written; give a file name.</source>
      <translation>{name}: no se puede escribir una capa en memoria; dé un nombre de archivo.</translation>
    </message>
    <message>
      <source>{name}: {path} ends in {found}, expected one of {wanted}.</source>
      <translation>{name}: {path} termina en {found}, se espera uno de {wanted}.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected a whole number{unit}.</source>
      <translation>{name}: se encontró '{given}', se espera un número entero{unit}.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected a number{unit}.</source>
      <translation>{name}: se encontró '{given}', se espera un número{unit}.</translation>
    </message>
    <message>
      <source>{name}: found {given}, expected {limits}{unit}.</source>
      <translation>{name}: se encontró {given}, se espera {limits}{unit}.</translation>
    </message>
    <message>
      <source>{name}: {crs} is geographic (degrees), expected a projected CRS in metres; use the UTM zone of your plot{zone}.</source>
      <translation>{name}: {crs} es geográfico (grados), se espera un SRC proyectado en metros; use la zona UTM de su parcela{zone}.</translation>
    </message>
    <message>
      <source>DTM: {dtm} is not a raster that can be read; give a terrain GeoTIFF.</source>
      <translation>DTM: {dtm} no es un ráster legible; dé un GeoTIFF del terreno.</translation>
    </message>
    <message>
      <source>{name}: {path} does not exist; give a folder that does.</source>
      <translation>{name}: {path} no existe; dé una carpeta que exista.</translation>
    </message>
    <message>
      <source>in {unit}</source>
      <translation>en {unit}</translation>
    </message>
    <message>
      <source>The TreeDGS engine is not set up yet ({takes}); {do}.</source>
      <translation>El motor de TreeDGS aún no está instalado ({takes}); {do}.</translation>
    </message>
    <message>
      <source>Stopped; what was finished is kept, run again to resume.</source>
      <translation>Detenido; lo terminado se conserva, ejecute otra vez para continuar.</translation>
    </message>
    <message>
      <source>No folder for the job's files can be made in {folder}; set TREEDGS_HOME to a folder that can be written.</source>
      <translation>En {folder} no se puede crear una carpeta para los archivos del trabajo; ponga TREEDGS_HOME en una carpeta donde se pueda escribir.</translation>
    </message>
    <message>
      <source>The TreeDGS engine is missing: {source} names {python}, which is not a Python program; {do}.</source>
      <translation>Falta el motor de TreeDGS: {source} nombra {python}, que no es un programa Python; {do}.</translation>
    </message>
    <message>
      <source>The TreeDGS engine needs Python 3.10 or newer: {python} ({source}) is {version}; {do}.</source>
      <translation>El motor de TreeDGS necesita Python 3.10 o posterior: {python} ({source}) es {version}; {do}.</translation>
    </message>
    <message>
      <source>This algorithm needs a part of the engine that is not set up ({extras}); run 'Set up the engine' (treedgs:setupengine) once more and tick it ({names}).</source>
      <translation>Este algoritmo necesita una parte del motor que no está instalada ({extras}); ejecute otra vez «Instalar el motor» (treedgs:setupengine) y márquela ({names}).</translation>
    </message>
    <message>
      <source>The TreeDGS engine is incomplete: {python} ({source}) lacks {names}; {do}.</source>
      <translation>El motor de TreeDGS está incompleto: a {python} ({source}) le falta {names}; {do}.</translation>
    </message>
    <message>
      <source>The TreeDGS engine does not start: {python} ({source}) gave no answer ({problem}); {do}.</source>
      <translation>El motor de TreeDGS no arranca: {python} ({source}) no respondió ({problem}); {do}.</translation>
    </message>
    <message>
      <source>The engine cannot be started: {program} ({problem}); {do}.</source>
      <translation>El motor no se puede iniciar: {program} ({problem}); {do}.</translation>
    </message>
    <message>
      <source>The engine speaks protocol {found}, this plugin {own}; run 'Set up the engine' (treedgs:setupengine) to update it.</source>
      <translation>El motor habla el protocolo {found}, este complemento el {own}; ejecute 'Instalar el motor' (treedgs:setupengine) para actualizarlo.</translation>
    </message>
    <message>
      <source>{target}: has {count} characters; the libraries' own paths would be longer than Windows allows, expected at most {most}: set TREEDGS_HOME to a short folder like C:\treedgs.</source>
      <translation>{target}: tiene {count} caracteres; las rutas de las bibliotecas serían más largas de lo que permite Windows, se esperan como máximo {most}: defina TREEDGS_HOME en una carpeta corta como C:\treedgs.</translation>
    </message>
    <message>
      <source>it touched memory it does not own</source>
      <translation>tocó memoria que no es suya</translation>
    </message>
    <message>
      <source>the processor lacks an instruction it needs</source>
      <translation>al procesador le falta una instrucción necesaria</translation>
    </message>
    <message>
      <source>a system library is missing, install the Visual C++ redistributable from https://aka.ms/vs/17/release/vc_redist.x64.exe</source>
      <translation>falta una biblioteca del sistema, instale Visual C++ Redistributable desde https://aka.ms/vs/17/release/vc_redist.x64.exe</translation>
    </message>
    <message>
      <source>it said nothing</source>
      <translation>no dijo nada</translation>
    </message>
    <message>
      <source>The engine ended with code {code}: {last} (log: {log}).</source>
      <translation>El motor terminó con el código {code}: {last} (registro: {log}).</translation>
    </message>
    <message>
      <source>The engine was killed by the system, most likely because memory ran out; close other programs, choose a faster preset or fewer photos, and run again to resume (log: {log}).</source>
      <translation>El sistema terminó el motor, probablemente porque se agotó la memoria; cierre otros programas, elija un preajuste más rápido o menos fotos, y ejecute otra vez para continuar (registro: {log}).</translation>
    </message>
    <message>
      <source>The engine crashed ({name}); run 'Check the engine' (treedgs:checkengine), and if that is fine report the log {log}.</source>
      <translation>El motor falló ({name}); ejecute 'Comprobar el motor' (treedgs:checkengine), y si ahí todo está bien comunique el registro {log}.</translation>
    </message>
    <message>
      <source>The engine was stopped from outside; run again to resume (log: {log}).</source>
      <translation>El motor fue detenido desde fuera; ejecute otra vez para continuar (registro: {log}).</translation>
    </message>
    <message>
      <source>The engine crashed: {why} (log: {log}).</source>
      <translation>El motor falló: {why} (registro: {log}).</translation>
    </message>
    <message>
      <source>Stand tables as Excel and PDF ({size})</source>
      <translation>Tablas de rodal en Excel y PDF ({size})</translation>
    </message>
    <message>
      <source>Simulated plots, dense points as PLY ({size})</source>
      <translation>Parcelas simuladas, puntos densos en PLY ({size})</translation>
    </message>
    <message>
      <source>no NVIDIA card was found</source>
      <translation>no se encontró ninguna tarjeta NVIDIA</translation>
    </message>
    <message>
      <source>there is no NVIDIA driver on this computer</source>
      <translation>en este equipo no hay controlador de NVIDIA</translation>
    </message>
    <message>
      <source>the NVIDIA driver does not answer ({answer})</source>
      <translation>el controlador de NVIDIA no responde ({answer})</translation>
    </message>
    <message>
      <source>{name}: its driver is {driver}, expected {least} or newer; update it and run this again</source>
      <translation>{name}: su controlador es {driver}, se espera {least} o posterior; actualícelo y ejecute esto otra vez</translation>
    </message>
    <message>
      <source>{name} is too old for the engine (compute capability {card}, expected {least})</source>
      <translation>{name} es demasiado antigua para el motor (capacidad de cómputo {card}, se espera {least})</translation>
    </message>
    <message>
      <source>{name} has {memory} MB of memory, expected {least}</source>
      <translation>{name} tiene {memory} MB de memoria, se esperan {least}</translation>
    </message>
    <message>
      <source>{name}, driver {driver}</source>
      <translation>{name}, controlador {driver}</translation>
    </message>
    <message>
      <source>{name}: the engine gets a copy of the layer '{layer}' as it shows it (features: {count}).</source>
      <translation>{name}: el motor recibe una copia de la capa '{layer}' tal como se muestra (objetos: {count}).</translation>
    </message>
    <message>
      <source>{name}: {path} cannot be read as a layer; give a file that QGIS opens.</source>
      <translation>{name}: {path} no se puede leer como capa; indique un archivo que QGIS abra.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' has edits that are not saved; save or drop them first.</source>
      <translation>{name}: la capa '{layer}' tiene cambios sin guardar; guárdelos o descártelos primero.</translation>
    </message>
    <message>
      <source>{name}: all {count} features of '{layer}' are used, not only the {chosen} selected.</source>
      <translation>{name}: se usan los {count} objetos de '{layer}', no solo los {chosen} seleccionados.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' cannot be read; correct its source.</source>
      <translation>{name}: la capa '{layer}' no se puede leer; corrija su origen.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' is no file on this computer; save it as a GeoTIFF first.</source>
      <translation>{name}: la capa '{layer}' no es un archivo de este equipo; guárdela primero como GeoTIFF.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' is filtered, or a copy without its trees; give the pairs' file.</source>
      <translation>{name}: la capa '{layer}' está filtrada o es una copia sin sus árboles; indique el archivo de los pares.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' cannot be copied for the engine ({why}).</source>
      <translation>{name}: la capa '{layer}' no se puede copiar para el motor ({why}).</translation>
    </message>
    <message>
      <source>Camera positions</source>
      <translation>Posiciones de las cámaras</translation>
    </message>
    <message>
      <source>Cameras from the photos</source>
      <translation>Cámaras a partir de las fotos</translation>
    </message>
    <message>
      <source>Photos matched where geotags and gimbal say</source>
      <translation>Fotos comparadas donde indican los geotags y el gimbal</translation>
    </message>
    <message>
      <source>Photos matched again, where the first cameras say</source>
      <translation>Fotos comparadas otra vez, donde lo indican las primeras cámaras</translation>
    </message>
    <message>
      <source>All photos matched anew</source>
      <translation>Todas las fotos comparadas de nuevo</translation>
    </message>
    <message>
      <source>Features in each photo</source>
      <translation>Puntos característicos de cada foto</translation>
    </message>
    <message>
      <source>Same points in several photos</source>
      <translation>Los mismos puntos en varias fotos</translation>
    </message>
    <message>
      <source>First placing of the cameras</source>
      <translation>Primera colocación de las cámaras</translation>
    </message>
    <message>
      <source>Fine adjustment of the cameras</source>
      <translation>Ajuste fino de las cámaras</translation>
    </message>
    <message>
      <source>Dense points</source>
      <translation>Puntos densos</translation>
    </message>
    <message>
      <source>Ground under the trees</source>
      <translation>Suelo bajo los árboles</translation>
    </message>
    <message>
      <source>Stems and their diameters</source>
      <translation>Troncos y sus diámetros</translation>
    </message>
    <message>
      <source>Looking for stems</source>
      <translation>Búsqueda de troncos</translation>
    </message>
    <message>
      <source>Fitting each stem</source>
      <translation>Ajuste de cada tronco</translation>
    </message>
    <message>
      <source>Asking the network for stems</source>
      <translation>Consultando a la red por los troncos</translation>
    </message>
    <message>
      <source>Measuring hidden stems farther up</source>
      <translation>Medición más arriba de los troncos ocultos</translation>
    </message>
    <message>
      <source>Measuring each stem</source>
      <translation>Medición de cada tronco</translation>
    </message>
    <message>
      <source>Stems, found and fitted</source>
      <translation>Troncos, hallados y ajustados</translation>
    </message>
    <message>
      <source>Heights of the trees</source>
      <translation>Alturas de los árboles</translation>
    </message>
    <message>
      <source>Picture of the ground</source>
      <translation>Imagen del suelo</translation>
    </message>
    <message>
      <source>Stand in three dimensions</source>
      <translation>Rodal en tres dimensiones</translation>
    </message>
    <message>
      <source>Looking for treetops</source>
      <translation>Búsqueda de las copas más altas</translation>
    </message>
    <message>
      <source>Writing tagged copies of the photos</source>
      <translation>Escritura de copias geoetiquetadas de las fotos</translation>
    </message>
    <message>
      <source>Drawing trees</source>
      <translation>Sorteando árboles</translation>
    </message>
    <message>
      <source>Comparing with the tapes</source>
      <translation>Comparando con las cintas</translation>
    </message>
    <message>
      <source>Growing the stand</source>
      <translation>Crecimiento del rodal</translation>
    </message>
    <message>
      <source>Drawing the photos</source>
      <translation>Dibujo de las fotos</translation>
    </message>
    <message>
      <source>LiDAR cloud</source>
      <translation>Nube LiDAR</translation>
    </message>
    <message>
      <source>Writing field table and truth</source>
      <translation>Escritura de la tabla de campo y la verdad</translation>
    </message>
    <message>
      <source>Comparing with the field trees</source>
      <translation>Comparación con los árboles de campo</translation>
    </message>
    <message>
      <source>Published methods on the same trees</source>
      <translation>Métodos publicados en los mismos árboles</translation>
    </message>
    <message>
      <source>Tables and figures of the paper</source>
      <translation>Tablas y figuras del artículo</translation>
    </message>
    <message>
      <source>Circles and cylinders on both clouds</source>
      <translation>Círculos y cilindros en ambas nubes</translation>
    </message>
    <message>
      <source>Photos that show breast height, and time</source>
      <translation>Fotos que muestran la altura del pecho, y tiempo</translation>
    </message>
    <message>
      <source>Dense points to start from</source>
      <translation>Puntos densos para empezar</translation>
    </message>
    <message>
      <source>Stereo of neighbouring photos</source>
      <translation>Estéreo de fotos vecinas</translation>
    </message>
    <message>
      <source>Fitting Gaussians</source>
      <translation>Ajuste de las gaussianas</translation>
    </message>
    <message>
      <source>Surface points</source>
      <translation>Puntos de superficie</translation>
    </message>
    <message>
      <source>Telling stems from the rest</source>
      <translation>Separación de fustes y resto</translation>
    </message>
    <message>
      <source>Reading the point cloud</source>
      <translation>Lectura de la nube de puntos</translation>
    </message>
    <message>
      <source>Pairing field and measured trees</source>
      <translation>Emparejamiento de árboles de campo y medidos</translation>
    </message>
    <message>
      <source>Stems at the places given</source>
      <translation>Fustes en los lugares indicados</translation>
    </message>
    <message>
      <source>Stems measured at places given before</source>
      <translation>Fustes medidos antes en los lugares dados</translation>
    </message>
    <message>
      <source>Comparing flights</source>
      <translation>Comparando vuelos</translation>
    </message>
    <message>
      <source>A picture of the evidence for each tree</source>
      <translation>Una imagen de la evidencia de cada árbol</translation>
    </message>
    <message>
      <source>Compiling for this processor</source>
      <translation>Compilación para este procesador</translation>
    </message>
    <message>
      <source>Writing layer and report</source>
      <translation>Escritura de la capa y el informe</translation>
    </message>
    <message>
      <source>Reading the tables</source>
      <translation>Lectura de las tablas</translation>
    </message>
    <message>
      <source>Estimating per hectare</source>
      <translation>Estimación por hectárea</translation>
    </message>
    <message>
      <source>Stems in the photos, area {number} of {all}</source>
      <translation>Troncos en las fotos, zona {number} de {all}</translation>
    </message>
    <message>
      <source>Dense points of plot {plot}</source>
      <translation>Puntos densos de la parcela {plot}</translation>
    </message>
    <message>
      <source>You may close this window: the run goes on, and its results come to the map.</source>
      <translation>Puede cerrar esta ventana: el proceso continúa y sus resultados aparecen en el mapa.</translation>
    </message>
    <message>
      <source>about {time} left</source>
      <translation>quedan unos {time}</translation>
    </message>
    <message>
      <source>Plots</source>
      <translation>Parcelas</translation>
    </message>
    <message>
      <source>Suggested pairs</source>
      <translation>Pares propuestos</translation>
    </message>
    <message>
      <source>Measured trees</source>
      <translation>Árboles medidos</translation>
    </message>
    <message>
      <source>Field trees</source>
      <translation>Árboles de campo</translation>
    </message>
    <message>
      <source>Plots searched</source>
      <translation>Parcelas buscadas</translation>
    </message>
    <message>
      <source>Crowns</source>
      <translation>Copas</translation>
    </message>
    <message>
      <source>Stems at true scale</source>
      <translation>Fustes a escala real</translation>
    </message>
    <message>
      <source>Stem sections</source>
      <translation>Secciones del fuste</translation>
    </message>
    <message>
      <source>Ground in the photos</source>
      <translation>Suelo en las fotos</translation>
    </message>
    <message>
      <source>Plots of the flight plan</source>
      <translation>Parcelas del plan de vuelo</translation>
    </message>
    <message>
      <source>Flight line</source>
      <translation>Línea de vuelo</translation>
    </message>
    <message>
      <source>Planned photos</source>
      <translation>Fotos planeadas</translation>
    </message>
    <message>
      <source>Stand by plot</source>
      <translation>Rodal por parcela</translation>
    </message>
    <message>
      <source>Trees of the stand table</source>
      <translation>Árboles de la tabla de rodal</translation>
    </message>
    <message>
      <source>Trees at two dates</source>
      <translation>Árboles en dos fechas</translation>
    </message>
    <message>
      <source>Taped trees</source>
      <translation>Árboles medidos con cinta</translation>
    </message>
    <message>
      <source>Ground</source>
      <translation>Terreno</translation>
    </message>
    <message>
      <source>Orthophoto of the ground</source>
      <translation>Ortofoto del suelo</translation>
    </message>
    <message>
      <source>temporary</source>
      <translation>temporal</translation>
    </message>
    <message>
      <source>The engine is being set up; wait until the message bar says that it is set up, then press Run again.</source>
      <translation>El motor se está instalando; espere a que la barra de mensajes diga que está listo y pulse Ejecutar de nuevo.</translation>
    </message>
    <message>
      <source>run the algorithm 'Set up the engine' (in a shell: qgis_process run treedgs:setupengine), or point the environment variable TREEDGS_PYTHON at a Python that has the engine's libraries</source>
      <translation>ejecute el algoritmo 'Instalar el motor' (en una consola: qgis_process run treedgs:setupengine), o ponga en la variable de entorno TREEDGS_PYTHON un Python que tenga las bibliotecas del motor</translation>
    </message>
    <message>
      <source>{size}, {low}–{high} min</source>
      <translation>{size}, {low}–{high} min</translation>
    </message>
    <message>
      <source>From drone photos to a stand table</source>
      <translation>De fotos de dron a la tabla de rodal</translation>
    </message>
    <message>
      <source>From a point cloud to a stand table</source>
      <translation>De una nube de puntos a la tabla de rodal</translation>
    </message>
    <message>
      <source>From drone photos to accuracy against field trees</source>
      <translation>De fotos de dron a la exactitud frente a árboles de campo</translation>
    </message>
    <message>
      <source>Ready-made models</source>
      <translation>Modelos preparados</translation>
    </message>
    <message>
      <source>Starting …</source>
      <translation>Empezando …</translation>
    </message>
    <message>
      <source>Set up again</source>
      <translation>Instalar de nuevo</translation>
    </message>
    <message>
      <source>Stop</source>
      <translation>Detener</translation>
    </message>
    <message>
      <source>The engine is not set up ({takes}).</source>
      <translation>El motor no está instalado ({takes}).</translation>
    </message>
    <message>
      <source>Add it now</source>
      <translation>Añadir ahora</translation>
    </message>
    <message>
      <source>Set up now</source>
      <translation>Instalar ahora</translation>
    </message>
    <message>
      <source>Open the report</source>
      <translation>Abrir el informe</translation>
    </message>
    <message>
      <source>The engine is set up; the algorithms can run.</source>
      <translation>El motor está instalado; los algoritmos pueden ejecutarse.</translation>
    </message>
    <message>
      <source>The engine is damaged; setting it up anew takes {takes}. Jobs and results stay.</source>
      <translation>El motor está dañado; instalarlo de nuevo ocupa {takes}. Trabajos y resultados quedan.</translation>
    </message>
    <message>
      <source>This needs a part of the engine that is not set up: {names} ({takes}).</source>
      <translation>Esto necesita una parte del motor que no está instalada: {names} ({takes}).</translation>
    </message>
    <message>
      <source>It failed; see the log.</source>
      <translation>Falló; vea el registro.</translation>
    </message>
    <message>
      <source>No Python that will do was found, and none that could fetch one; install Python 3.12 (python.org) and run this again.</source>
      <translation>No se encontró ningún Python adecuado ni ninguno que pudiera descargarlo; instale Python 3.12 (python.org) y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>{what} could not be fetched; read the lines above, and check the network (behind a proxy set HTTPS_PROXY), or install Python 3.12 (python.org) and run this again.</source>
      <translation>No se pudo descargar {what}; lea las líneas anteriores y compruebe la red (detrás de un proxy defina HTTPS_PROXY), o instale Python 3.12 (python.org) y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>No suitable Python is installed; getting Python {version} for the engine alone.</source>
      <translation>No hay instalado ningún Python adecuado; se descarga Python {version} solo para el motor.</translation>
    </message>
    <message>
      <source>{low} to {high}</source>
      <translation>de {low} a {high}</translation>
    </message>
    <message>
      <source>at least {low}</source>
      <translation>al menos {low}</translation>
    </message>
    <message>
      <source>at most {high}</source>
      <translation>como máximo {high}</translation>
    </message>
    <message>
      <source>Preparing the libraries for a quick start</source>
      <translation>Preparando las bibliotecas para un arranque rápido</translation>
    </message>
    <message>
      <source>Fetching {name} ({done} of {all} MB are here)</source>
      <translation>Bajando {name} ({done} de {all} MB están aquí)</translation>
    </message>
    <message>
      <source>Installing {name} ({number} of {all})</source>
      <translation>Instalando {name} ({number} de {all})</translation>
    </message>
    <message>
      <source>A library that pip received is not the one that was tested (its hash differs); a proxy or a mirror may have changed it: try another network, or give a folder of wheels.</source>
      <translation>Una biblioteca que recibió pip no es la que se probó (su hash difiere); quizá la cambió un proxy o un espejo: pruebe con otra red o indique una carpeta de wheels.</translation>
    </message>
    <message>
      <source>pip could not install {packages} into {target}; read the lines above: without network give a folder of wheels, behind a proxy set HTTPS_PROXY, then run this again.</source>
      <translation>pip no pudo instalar {packages} en {target}; lea las líneas anteriores: sin red indique una carpeta de wheels, detrás de un proxy defina HTTPS_PROXY, y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>The disk with {target} is full; make room or set TREEDGS_HOME to a larger disk.</source>
      <translation>El disco de {target} está lleno; libere espacio o defina TREEDGS_HOME en un disco mayor.</translation>
    </message>
    <message>
      <source>{target}: a file is in use; close QGIS and other programs that run the engine, and run this again.</source>
      <translation>{target}: un archivo está en uso; cierre QGIS y otros programas que ejecuten el motor y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>{wheels}: has no wheel of {name} for Python {python} on this system; make the folder with this Python's version on the same system, or choose another Python (PYTHON).</source>
      <translation>{wheels}: no tiene wheel de {name} para Python {python} en este sistema; llene la carpeta con esa versión de Python en el mismo sistema, o elija otro Python (PYTHON).</translation>
    </message>
    <message>
      <source>{name} has no ready-made package (wheel) for this system ({system}, Python {python}); the engine runs on Windows x64, on Linux x86-64, and on macOS 15 or newer with an Apple processor. The network works.</source>
      <translation>{name} no tiene paquete listo (wheel) para este sistema ({system}, Python {python}); el motor funciona en Windows x64, Linux x86-64 y macOS 15 o posterior con procesador Apple. La red funciona.</translation>
    </message>
    <message>
      <source>{name} has no ready-made package (wheel) for Python {python} on this system; install Python 3.12 and name it (PYTHON), and run this again. The network works.</source>
      <translation>{name} no tiene paquete listo (wheel) para Python {python} en este sistema; instale Python 3.12, indíquelo (PYTHON) y ejecútelo de nuevo. La red funciona.</translation>
    </message>
    <message>
      <source>pip could not reach the package index to install {packages}; without network give a folder of wheels, behind a proxy set HTTPS_PROXY, then run this again.</source>
      <translation>pip no pudo llegar al índice de paquetes para instalar {packages}; sin red indique una carpeta de wheels, detrás de un proxy defina HTTPS_PROXY, y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>Stem list</source>
      <translation>Lista de troncos</translation>
    </message>
    <message>
      <source>3D view of this plot</source>
      <translation>Vista 3D de esta parcela</translation>
    </message>
    <message>
      <source>Try it with a sample flight</source>
      <translation>Probar con un vuelo de ejemplo</translation>
    </message>
    <message>
      <source>No Python 3.10 or newer with venv was found; install one (Debian and Ubuntu: apt install python3-venv; Windows and macOS: python.org, version 3.12) and run this again.</source>
      <translation>No se encontró Python 3.10 o posterior con venv; instale uno (Debian y Ubuntu: apt install python3-venv; Windows y macOS: python.org, versión 3.12) y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>{path} is newer than the engine's libraries, which exist for Python 3.10 to 3.14; install one of these beside it and run this again.</source>
      <translation>{path} es más nuevo que las bibliotecas del motor, que existen para Python 3.10 a 3.14; instale uno de estos además y ejecútelo de nuevo.</translation>
    </message>
    <message>
      <source>{path}: is not a Python 3.10 or newer with venv and ensurepip; install one or name another.</source>
      <translation>{path}: no es un Python 3.10 o posterior con venv y ensurepip; instale uno o indique otro.</translation>
    </message>
    <message>
      <source>{file}: holds no run of photos ({problem}); measure the stem by tape.</source>
      <translation>{file}: no contiene ninguna ejecución de fotos ({problem}); mida el fuste con cinta.</translation>
    </message>
    <message>
      <source>{layer}: its run's workspace was not found; only a layer of photos beside its workspace can do this.</source>
      <translation>{layer}: no se encontró la carpeta de trabajo de su ejecución; solo es posible con una capa de fotos junto a su carpeta de trabajo.</translation>
    </message>
    <message>
      <source>{layer}: is being edited; save the edits and end editing first.</source>
      <translation>{layer}: se está editando; guarde los cambios y termine antes la edición.</translation>
    </message>
    <message>
      <source>nothing was measured; the log says why</source>
      <translation>no se midió nada; el registro dice por qué</translation>
    </message>
    <message>
      <source>Tree {tree}: taped {taped} cm, but measured {measured} cm. Is it this tree and this number? Press Taped DBH (D) again to keep it, or type another number.</source>
      <translation>Árbol {tree}: con cinta {taped} cm, pero medido {measured} cm. ¿Es este árbol y este número? Pulse DAP con cinta (D) otra vez para conservarlo, o escriba otro número.</translation>
    </message>
    <message>
      <source>The last step was taken back.</source>
      <translation>Se deshizo el último paso.</translation>
    </message>
    <message>
      <source>Click on the map; the right button or Esc ends it.</source>
      <translation>Haga clic en el mapa; el botón derecho o Esc termina.</translation>
    </message>
    <message>
      <source>Decided: {done} of {all} to check or without a DBH, {others} of the other {rest}.</source>
      <translation>Decididos: {done} de {all} por revisar o sin DAP, {others} de los otros {rest}.</translation>
    </message>
    <message>
      <source>No other tree stands where you clicked; click on its symbol.</source>
      <translation>Donde hizo clic no hay otro árbol; haga clic en su símbolo.</translation>
    </message>
    <message>
      <source>Another stem is being measured; wait for it.</source>
      <translation>Se está midiendo otro fuste; espere a que termine.</translation>
    </message>
    <message>
      <source>No tree layer in the project: add trees.gpkg.</source>
      <translation>No hay capa de árboles en el proyecto: añada trees.gpkg.</translation>
    </message>
    <message>
      <source>No such tree is left; choose 'all' to see every tree.</source>
      <translation>No queda ningún árbol así; elija 'todos' para ver cada árbol.</translation>
    </message>
    <message>
      <source>{number} of {all}</source>
      <translation>{number} de {all}</translation>
    </message>
    <message>
      <source>Not decided yet.</source>
      <translation>Aún sin decidir.</translation>
    </message>
    <message>
      <source>Before: {meaning}; Undo last step (U) brings it back.</source>
      <translation>Antes: {meaning}; Deshacer último paso (U) lo recupera.</translation>
    </message>
    <message>
      <source>Tree {tree} was added: a stem without a DBH.</source>
      <translation>Se añadió el árbol {tree}: un fuste sin DAP.</translation>
    </message>
    <message>
      <source>Tree {tree} is being measured …</source>
      <translation>Midiendo el árbol {tree} …</translation>
    </message>
    <message>
      <source>Found '{text}', expected the number of a tree.</source>
      <translation>Se encontró '{text}', se esperaba el número de un árbol.</translation>
    </message>
    <message>
      <source>Before: {cm} cm; press As it was (W) to go back.</source>
      <translation>Antes: {cm} cm; «Como estaba (W)» lo deshace.</translation>
    </message>
    <message>
      <source>Tree {tree}: {taped} cm, but {known} cm in the layer; these look like millimetres, or the decimal point is elsewhere: type the diameter in centimetres.</source>
      <translation>Árbol {tree}: {taped} cm, pero {known} cm en la capa; parecen milímetros, o la coma está en otro lugar: escriba el diámetro en centímetros.</translation>
    </message>
    <message>
      <source>Taped DBH: found '{text}', expected {low} to {high} cm.</source>
      <translation>DAP con cinta: se encontró '{text}', se esperaba de {low} a {high} cm.</translation>
    </message>
    <message>
      <source>Tree {tree}: taped {taped} cm, measured {measured} cm; check the number and that it is this tree.</source>
      <translation>Árbol {tree}: cinta {taped} cm, medido {measured} cm; compruebe el número y que sea este árbol.</translation>
    </message>
    <message>
      <source>{layer}: nothing was written ({why}); close other programs that use the file, or save a copy of it.</source>
      <translation>{layer}: no se escribió nada ({why}); cierre otros programas que usen el archivo o guarde una copia.</translation>
    </message>
    <message>
      <source>Tree {tree} cannot be the same as {other}; give the number of another tree of this layer.</source>
      <translation>El árbol {tree} no puede ser el mismo que {other}; indique el número de otro árbol de esta capa.</translation>
    </message>
    <message>
      <source>Tree {other} counts nowhere itself (rejected, or merged): one of the two has to count.</source>
      <translation>El árbol {other} no cuenta en ningún sitio (rechazado o unido): uno de los dos tiene que contar.</translation>
    </message>
    <message>
      <source>Tree {tree} stands {away} m from here; decide about that tree.</source>
      <translation>El árbol {tree} está a {away} m de aquí; decida sobre ese árbol.</translation>
    </message>
    <message>
      <source>This place lies {away} m from the nearest tree of the layer; click inside the plot.</source>
      <translation>Este lugar está a {away} m del árbol más cercano de la capa; haga clic dentro de la parcela.</translation>
    </message>
    <message>
      <source>here stands a stem</source>
      <translation>aquí hay un fuste</translation>
    </message>
    <message>
      <source>the file cannot be changed</source>
      <translation>el archivo no se puede modificar</translation>
    </message>
    <message>
      <source>Tree {other} is merged into tree {tree}, which therefore has to count; change that one first.</source>
      <translation>El árbol {other} está unido al árbol {tree}, que por eso tiene que contar; cambie antes aquel.</translation>
    </message>
    <message>
      <source>Tree {tree} has no DBH: it counts as a tree without one; give its taped DBH if you have it.</source>
      <translation>El árbol {tree} no tiene DAP: cuenta como árbol sin él; indique el DAP con cinta si lo tiene.</translation>
    </message>
    <message>
      <source>Click the picture to see it in full size.</source>
      <translation>Haga clic en la imagen para verla a tamaño completo.</translation>
    </message>
    <message>
      <source>Accept (A)</source>
      <translation>Aceptar (A)</translation>
    </message>
    <message>
      <source>No tree here (X)</source>
      <translation>Aquí no hay árbol (X)</translation>
    </message>
    <message>
      <source>Taped DBH (D)</source>
      <translation>DAP con cinta (D)</translation>
    </message>
    <message>
      <source>Same tree as (M)</source>
      <translation>Mismo árbol que (M)</translation>
    </message>
    <message>
      <source>pick on the map</source>
      <translation>elegir en el mapa</translation>
    </message>
    <message>
      <source>Here stands a stem (S)</source>
      <translation>Aquí hay un fuste (S)</translation>
    </message>
    <message>
      <source>Its foot is here: measure again (B)</source>
      <translation>Su pie está aquí: medir de nuevo (B)</translation>
    </message>
    <message>
      <source>As it was (W)</source>
      <translation>Como estaba (W)</translation>
    </message>
    <message>
      <source>measure it in the photos at once</source>
      <translation>medirlo enseguida en las fotos</translation>
    </message>
    <message>
      <source>Save note</source>
      <translation>Guardar nota</translation>
    </message>
    <message>
      <source>Take decision back (C)</source>
      <translation>Retirar decisión (C)</translation>
    </message>
    <message>
      <source>Undo last step (U)</source>
      <translation>Deshacer último paso (U)</translation>
    </message>
    <message>
      <source>a note (goes with the decision)</source>
      <translation>una nota (acompaña a la decisión)</translation>
    </message>
    <message>
      <source>DBH, cm</source>
      <translation>DAP, cm</translation>
    </message>
    <message>
      <source>number</source>
      <translation>número</translation>
    </message>
    <message>
      <source>No evidence sheet of this tree was found beside the layer.</source>
      <translation>No se encontró la ficha de evidencia de este árbol junto a la capa.</translation>
    </message>
    <message>
      <source>only those not decided yet</source>
      <translation>solo los no decididos aún</translation>
    </message>
    <message>
      <source>◀ Previous (P)</source>
      <translation>◀ Anterior (P)</translation>
    </message>
    <message>
      <source>Next (N) ▶</source>
      <translation>Siguiente (N) ▶</translation>
    </message>
    <message>
      <source>Zoom to (Z)</source>
      <translation>Acercar (Z)</translation>
    </message>
    <message>
      <source>The tree and its DBH are right.</source>
      <translation>El árbol y su DAP son correctos.</translation>
    </message>
    <message>
      <source>No tree stands here; it counts nowhere.</source>
      <translation>Aquí no hay árbol; no cuenta en ningún sitio.</translation>
    </message>
    <message>
      <source>Its DBH was taped: type it in cm. The measured one stays beside it.</source>
      <translation>Su DAP se midió con cinta: escríbalo en cm. El medido se conserva al lado.</translation>
    </message>
    <message>
      <source>This is the same tree as another one, which counts.</source>
      <translation>Es el mismo árbol que otro, que es el que cuenta.</translation>
    </message>
    <message>
      <source>Click on the map where a stem stands that the layer does not have.</source>
      <translation>Haga clic en el mapa donde hay un fuste que la capa no tiene.</translation>
    </message>
    <message>
      <source>Click on the map where the foot of this stem is; it is measured there in the photos.</source>
      <translation>Haga clic en el mapa donde está el pie de este tronco; se mide allí en las fotos.</translation>
    </message>
    <message>
      <source>Take the tree back to what it was before it was measured again.</source>
      <translation>Devolver el árbol a como estaba antes de medirlo de nuevo.</translation>
    </message>
    <message>
      <source>Take the decision about this tree back.</source>
      <translation>Retirar la decisión sobre este árbol.</translation>
    </message>
    <message>
      <source>Take back what was done last in this panel.</source>
      <translation>Deshacer lo último que se hizo en este panel.</translation>
    </message>
    <message>
      <source>Show</source>
      <translation>Mostrar</translation>
    </message>
    <message>
      <source>measured, to be checked</source>
      <translation>medido, por revisar</translation>
    </message>
    <message>
      <source>to be checked, or without a DBH</source>
      <translation>por revisar o sin DAP</translation>
    </message>
    <message>
      <source>to be checked</source>
      <translation>por revisar</translation>
    </message>
    <message>
      <source>measured, nothing against them</source>
      <translation>medidos, sin objeciones</translation>
    </message>
    <message>
      <source>decided by a person</source>
      <translation>decididos por una persona</translation>
    </message>
    <message>
      <source>all</source>
      <translation>todos</translation>
    </message>
    <message>
      <source>No DBH was measured.</source>
      <translation>No se midió el DAP.</translation>
    </message>
    <message>
      <source>Decided: {meaning}</source>
      <translation>Decidido: {meaning}</translation>
    </message>
    <message>
      <source>plot {plot}</source>
      <translation>parcela {plot}</translation>
    </message>
    <message>
      <source>{count} photos see it</source>
      <translation>{count} fotos lo ven</translation>
    </message>
    <message>
      <source>{count} slices</source>
      <translation>{count} rebanadas</translation>
    </message>
    <message>
      <source>leans {angle}°</source>
      <translation>inclinación {angle}°</translation>
    </message>
    <message>
      <source>{height} m tall</source>
      <translation>{height} m de alto</translation>
    </message>
    <message>
      <source>The sample flight did not come with this copy of the plugin; run: make sample</source>
      <translation>El vuelo de ejemplo no vino con esta copia del complemento; ejecute: make sample</translation>
    </message>
    <message>
      <source>{folder}: the sample flight cannot be written ({problem}); give another FOLDER.</source>
      <translation>{folder}: el vuelo de ejemplo no se puede escribir ({problem}); dé otro FOLDER.</translation>
    </message>
    <message>
      <source>Stems so far</source>
      <translation>Troncos hasta ahora</translation>
    </message>
    <message>
      <source>The sample flight was measured before.</source>
      <translation>El vuelo de ejemplo ya se midió.</translation>
    </message>
    <message>
      <source>{layer}: this QGIS opens no 3D view by itself; take View ▸ New 3D Map View, and there give Configure ▸ Terrain the terrain model.</source>
      <translation>{layer}: este QGIS no abre por sí mismo una vista 3D; elija Ver ▸ Nueva vista de mapa 3D e indique allí, en Configurar ▸ Terreno, el modelo del terreno.</translation>
    </message>
    <message>
      <source>Plan the flight</source>
      <translation>Planificar el vuelo</translation>
    </message>
    <message>
      <source>1 Plan</source>
      <translation>1 Planificar</translation>
    </message>
    <message>
      <source>What to fly for a wanted error here: the flight with the fewest photos, as mission files and a brief.</source>
      <translation>Qué volar aquí para un error deseado: el vuelo con menos fotos, como ficheros de misión y hoja de campo.</translation>
    </message>
    <message>
      <source>Compares flights over the plots (orbits, crosshatch, nadir with oblique lines; two heights, two tilts, several densities) by a model of what crowns and stems leave to be seen at breast height, and takes the one with the fewest photos that reaches the wanted standard error and share of stems. The stand is described by a canopy height model, a LiDAR cloud, the tree layer of an earlier visit, or five numbers. The flight follows the terrain, keeps its clearance over the canopy everywhere, and is as fast as trigger, blur and rolling shutter allow; what cannot be flown safely is refused. Heights in the mission files are over the take-off. Writes plan.kmz (DJI), plan.plan (QGroundControl), plan_litchi_1.csv, plan.gpkg (photos, way, footprints, plots with what is expected), brief.pdf and brief.html. Expectations are a model's; after the flight photos-to-dbh, given the plan, reports planned against got. Rules of the air and the pilot's eyes come first.</source>
      <translation>Compara vuelos sobre las parcelas (órbitas, cuadrícula cruzada, nadir con líneas oblicuas; dos alturas, dos inclinaciones, varias densidades) con un modelo de lo que copas y fustes dejan ver a la altura del pecho, y toma el que con menos fotos alcanza el error estándar y la proporción de fustes deseados. El rodal se describe con un modelo de alturas de copas, una nube LiDAR, la capa de árboles de una visita anterior o cinco números. El vuelo sigue el terreno, guarda en todo lugar su distancia a las copas y es tan rápido como permiten el disparo, el desenfoque y el obturador rodante; lo que no puede volarse con seguridad se rechaza. Las alturas de los ficheros de misión son sobre el despegue. Escribe plan.kmz (DJI), plan.plan (QGroundControl), plan_litchi_1.csv, plan.gpkg (fotos, recorrido, huellas, parcelas con lo esperado), brief.pdf y brief.html. Lo esperado es de un modelo; después del vuelo photos-to-dbh, con el plan dado, informa de lo planificado y lo logrado. Las normas del aire y los ojos del piloto van primero.</translation>
    </message>
    <message>
      <source>plots to photograph: CSV as for stand-table, or polygons</source>
      <translation>parcelas que fotografiar: CSV como para stand-table, o polígonos</translation>
    </message>
    <message>
      <source>DTM</source>
      <translation>MDT</translation>
    </message>
    <message>
      <source>terrain model; without one the ground is taken as level</source>
      <translation>modelo del terreno; sin él el suelo se toma como llano</translation>
    </message>
    <message>
      <source>Canopy heights, cloud or trees there</source>
      <translation>Alturas del dosel, nube o árboles allí</translation>
    </message>
    <message>
      <source>what stands there: canopy height model (GeoTIFF), LiDAR cloud, or tree layer of an earlier visit; what it does not say comes from the numbers below</source>
      <translation>lo que hay allí: modelo de alturas de copas (GeoTIFF), nube LiDAR o capa de árboles de una visita anterior; lo que no dice viene de los números de abajo</translation>
    </message>
    <message>
      <source>Camera</source>
      <translation>Cámara</translation>
    </message>
    <message>
      <source>camera: m3e, m3m, m4e, p4rtk, p1-35, mini4pro, air3, a photo of it, or width,height,focal in pixels, and where known the shortest time between two photos in s and the rolling shutter in ms</source>
      <translation>cámara: m3e, m3m, m4e, p4rtk, p1-35, mini4pro, air3, una foto suya, o ancho,alto,focal en píxeles; y, si se conocen, el menor tiempo entre dos fotos en s y el obturador rodante en ms</translation>
    </message>
    <message>
      <source>Target error [cm]</source>
      <translation>Error objetivo [cm]</translation>
    </message>
    <message>
      <source>wanted standard error of a DBH, median of the stems</source>
      <translation>error estándar deseado de un DAP, mediana de los fustes</translation>
    </message>
    <message>
      <source>Target share [%]</source>
      <translation>Proporción objetivo [%]</translation>
    </message>
    <message>
      <source>wanted share of the stems that get a DBH</source>
      <translation>proporción deseada de los fustes que reciben un DAP</translation>
    </message>
    <message>
      <source>Batteries</source>
      <translation>Baterías</translation>
    </message>
    <message>
      <source>instead of the targets: the best flight with so many batteries</source>
      <translation>en lugar de los objetivos: el mejor vuelo con tantas baterías</translation>
    </message>
    <message>
      <source>Stems [1/ha]</source>
      <translation>Troncos [1/ha]</translation>
    </message>
    <message>
      <source>stems a hectare, where nothing maps them</source>
      <translation>fustes por hectárea, donde nada los cartografía</translation>
    </message>
    <message>
      <source>DBH mean [cm]</source>
      <translation>DAP medio [cm]</translation>
    </message>
    <message>
      <source>mean DBH</source>
      <translation>DAP medio</translation>
    </message>
    <message>
      <source>DBH standard deviation [cm]</source>
      <translation>Desviación estándar del DAP [cm]</translation>
    </message>
    <message>
      <source>standard deviation of the DBHs</source>
      <translation>desviación estándar de los DAP</translation>
    </message>
    <message>
      <source>Tree height [m]</source>
      <translation>Altura del árbol [m]</translation>
    </message>
    <message>
      <source>mean height of the trees</source>
      <translation>altura media de los árboles</translation>
    </message>
    <message>
      <source>Crown base [m]</source>
      <translation>Base de la copa [m]</translation>
    </message>
    <message>
      <source>mean height of the lowest living branches</source>
      <translation>altura media de las ramas vivas más bajas</translation>
    </message>
    <message>
      <source>Take off</source>
      <translation>Despegue</translation>
    </message>
    <message>
      <source>place of the take-off, easting,northing in the CRS of the plan; all heights in the mission files are over it; default: the most open place near the plots</source>
      <translation>lugar del despegue, este,norte en el SRC del plan; todas las alturas de los ficheros de misión son sobre él; por defecto: el lugar más abierto cerca de las parcelas</translation>
    </message>
    <message>
      <source>Output</source>
      <translation>Salida</translation>
    </message>
    <message>
      <source>folder for the plan's files</source>
      <translation>carpeta para los ficheros del plan</translation>
    </message>
    <message>
      <source>Leaf area index</source>
      <translation>Índice de área foliar</translation>
    </message>
    <message>
      <source>one-sided leaf area over ground area; default: from a LiDAR cloud, else 2.5</source>
      <translation>área foliar de una cara por área de suelo; por defecto: de una nube LiDAR, si no 2,5</translation>
    </message>
    <message>
      <source>Exposure [ms]</source>
      <translation>Tiempo de exposición [ms]</translation>
    </message>
    <message>
      <source>shutter: 1 ms is 1/1000 s</source>
      <translation>obturador: 1 ms es 1/1000 s</translation>
    </message>
    <message>
      <source>Speed [m/s]</source>
      <translation>Velocidad [m/s]</translation>
    </message>
    <message>
      <source>most speed to fly at</source>
      <translation>velocidad máxima de vuelo</translation>
    </message>
    <message>
      <source>Distance kept from the crowns [m]</source>
      <translation>Distancia a las copas [m]</translation>
    </message>
    <message>
      <source>least height over the canopy, anywhere on the way</source>
      <translation>altura mínima sobre las copas, en todo el recorrido</translation>
    </message>
    <message>
      <source>Highest flight over the ground [m]</source>
      <translation>Altura máxima de vuelo sobre el suelo [m]</translation>
    </message>
    <message>
      <source>most height over the ground, by law or permit</source>
      <translation>altura máxima sobre el suelo, por ley o permiso</translation>
    </message>
    <message>
      <source>Flight date</source>
      <translation>Fecha del vuelo</translation>
    </message>
    <message>
      <source>day of the flight, year-month-day, for the sun; default: today</source>
      <translation>día del vuelo, año-mes-día, para el sol; por defecto: hoy</translation>
    </message>
    <message>
      <source>CRS</source>
      <translation>SRC</translation>
    </message>
    <message>
      <source>CRS of the plan, in metres; default: that of the DTM, or of the plots</source>
      <translation>SRC del plan, en metros; por defecto: el del MDT o el de las parcelas</translation>
    </message>
    <message>
      <source>Pattern</source>
      <translation>Patrón</translation>
    </message>
    <message>
      <source>pattern of the flight; auto: whichever needs the fewest photos</source>
      <translation>patrón del vuelo; auto: el que necesita menos fotos</translation>
    </message>
    <message>
      <source>the plan's folder</source>
      <translation>carpeta del plan</translation>
    </message>
    <message>
      <source>the plan as layers (GeoPackage)</source>
      <translation>el plan como capas (GeoPackage)</translation>
    </message>
    <message>
      <source>mission for DJI Pilot 2 (WPML)</source>
      <translation>misión para DJI Pilot 2 (WPML)</translation>
    </message>
    <message>
      <source>mission for QGroundControl</source>
      <translation>misión para QGroundControl</translation>
    </message>
    <message>
      <source>mission for Litchi (the first file)</source>
      <translation>misión para Litchi (el primer fichero)</translation>
    </message>
    <message>
      <source>brief for the crew (PDF)</source>
      <translation>hoja para el equipo (PDF)</translation>
    </message>
    <message>
      <source>the same as a page</source>
      <translation>lo mismo como página</translation>
    </message>
    <message>
      <source>photos</source>
      <translation>fotos</translation>
    </message>
    <message>
      <source>pattern of the flight</source>
      <translation>patrón del vuelo</translation>
    </message>
    <message>
      <source>height over the ground, metres</source>
      <translation>altura sobre el suelo, metros</translation>
    </message>
    <message>
      <source>heading of the lines, degrees from grid north</source>
      <translation>rumbo de las líneas, grados desde el norte de cuadrícula</translation>
    </message>
    <message>
      <source>expected share of the stems with a DBH</source>
      <translation>proporción esperada de los fustes con DAP</translation>
    </message>
    <message>
      <source>expected standard error of a DBH, median, cm</source>
      <translation>error estándar esperado de un DAP, mediana, cm</translation>
    </message>
    <message>
      <source>expected clear views a stem, mean</source>
      <translation>vistas libres esperadas por fuste, media</translation>
    </message>
    <message>
      <source>minutes in the air</source>
      <translation>minutos en el aire</translation>
    </message>
    <message>
      <source>batteries</source>
      <translation>baterías</translation>
    </message>
    <message>
      <source>gigabytes of photos</source>
      <translation>gigabytes de fotos</translation>
    </message>
    <message>
      <source>seconds to process on one thread</source>
      <translation>segundos de proceso en un hilo</translation>
    </message>
    <message>
      <source>speed, metres a second</source>
      <translation>velocidad, metros por segundo</translation>
    </message>
    <message>
      <source>lowest height over the canopy, metres</source>
      <translation>altura mínima sobre las copas, metros</translation>
    </message>
    <message>
      <source>share of the stems with 20 photos more</source>
      <translation>proporción de los fustes con 20 fotos más</translation>
    </message>
    <message>
      <source>standard error with 20 photos more, cm</source>
      <translation>error estándar con 20 fotos más, cm</translation>
    </message>
    <message>
      <source>Measure DBH from drone photos</source>
      <translation>Medir el DAP en fotos de dron</translation>
    </message>
    <message>
      <source>2 Measure</source>
      <translation>2 Medir</translation>
    </message>
    <message>
      <source>Drone photos (and PPK geotags) in, tree points with DBH, error and reasons out.</source>
      <translation>Entran fotos de dron (y geoetiquetas PPK), salen puntos de árbol con DAP, error y motivos.</translation>
    </message>
    <message>
      <source>Inputs: overlapping drone photos taken above the canopy, most of them oblique (30 to 50 degrees from straight down), at about 2 cm a pixel or finer; PPK or RTK geotags. Output: one point per stem found, with DBH (cm), its standard error and 90 % interval (cm), and a reason wherever no DBH could be measured. Stems under 7.5 cm and stems that fewer than three photos see at breast height are refused. A second run in the same workspace resumes. Errors and limits were calibrated on rendered and simulated plots, mostly pines; no photo of a tree that somebody taped has been measured yet. A network trained on TreeDGS's own simulator decides which pixels show stems and which ivy. Tape some trees: they say how right the diameters are.</source>
      <translation>Entradas: fotos de dron con solape tomadas por encima del dosel, la mayoría oblicuas (de 30 a 50 grados desde la vertical), a unos 2 cm por píxel o más finas; geoetiquetas PPK o RTK. Salida: un punto por tronco encontrado, con DAP (cm), su error estándar e intervalo del 90 % (cm), y un motivo donde no se pudo medir el DAP. Se rechazan los troncos de menos de 7,5 cm y los que menos de tres fotos ven a la altura del pecho. Una segunda ejecución en la misma carpeta de trabajo continúa. Los errores y los límites se calibraron en parcelas renderizadas y simuladas, en su mayoría de pinos; aún no se ha medido ninguna foto de un árbol que alguien midiera con cinta. Una red entrenada con el simulador de TreeDGS decide qué píxeles muestran troncos y cuáles hiedra. Mida algunos árboles con cinta: dicen cuán correctos son los diámetros.</translation>
    </message>
    <message>
      <source>Photos</source>
      <translation>Fotos</translation>
    </message>
    <message>
      <source>Folder with the original drone photos (JPEG) of one plot or block.</source>
      <translation>Carpeta con las fotos originales del dron (JPEG) de una parcela o un bloque.</translation>
    </message>
    <message>
      <source>Geotags</source>
      <translation>Geoetiquetas</translation>
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos (PPK), or a CSV; without it EXIF/XMP positions are used.</source>
      <translation>Carpeta o archivo con MRK y .pos de RTKLIB (PPK), o un CSV; si falta, valen las posiciones EXIF/XMP.</translation>
    </message>
    <message>
      <source>CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); without it all that photos see well.</source>
      <translation>CSV de parcelas: plot_id, easting, northing, radius_m (o lon, lat); si falta, todo lo que las fotos ven bien.</translation>
    </message>
    <message>
      <source>Project CRS, projected and in metres, for example EPSG:6344, or with a height datum, EPSG:6344+5703; default: the one that is usual where the photos lie; the log names it and says why</source>
      <translation>SRC del proyecto, proyectado y en metros, por ejemplo EPSG:6344, o con datum de alturas, EPSG:6344+5703; por omisión: el habitual donde están las fotos; el registro lo nombra y dice por qué</translation>
    </message>
    <message>
      <source>Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is found in the photos.</source>
      <translation>Modelo del terreno (GeoTIFF) en las alturas de las geoetiquetas; si falta, el suelo se busca en las fotos.</translation>
    </message>
    <message>
      <source>Dry run</source>
      <translation>Ensayo sin escribir</translation>
    </message>
    <message>
      <source>Only check inputs, overlap, fixed positions, memory and disk, and estimate the time; writes nothing.</source>
      <translation>Solo comprueba entradas, solape, posiciones fijas, memoria y disco, y estima el tiempo; no escribe nada.</translation>
    </message>
    <message>
      <source>Workspace</source>
      <translation>Carpeta de trabajo</translation>
    </message>
    <message>
      <source>Folder for intermediate results; a second run resumes there. Not given: beside the photos, NAME_treedgs.</source>
      <translation>Carpeta para resultados intermedios; una segunda ejecución continúa ahí. Si no se indica: junto a las fotos, NAME_treedgs.</translation>
    </message>
    <message>
      <source>Tree layer to write (.gpkg, .shp, .geojson or .csv).</source>
      <translation>Capa de árboles que se escribe (.gpkg, .shp, .geojson o .csv).</translation>
    </message>
    <message>
      <source>Geotags CRS</source>
      <translation>SRC de las geoetiquetas</translation>
    </message>
    <message>
      <source>Reference frame of the geotags (geographic), for example EPSG:7912 for ITRF2014; default: the project's.</source>
      <translation>Marco de referencia de las geoetiquetas (geográfico), por ejemplo EPSG:7912 para ITRF2014; por defecto, el del proyecto.</translation>
    </message>
    <message>
      <source>Ground control points</source>
      <translation>Puntos de control</translation>
    </message>
    <message>
      <source>Ground control and check points: gcp_list.txt of OpenDroneMap, or CSV with label, easting, northing, height (or lon, lat, height), photo, u, v; for drones without PPK, for photos without any position (three or more points), and to check any block. In a CSV also known lengths between two marked points (bar, length_m), for the scale.</source>
      <translation>Puntos de control y de comprobación: gcp_list.txt de OpenDroneMap, o CSV con label, easting, northing, height (o lon, lat, height), photo, u, v; para drones sin PPK, para fotos sin ninguna posición (tres o más puntos) y para comprobar cualquier bloque. En un CSV también longitudes conocidas entre dos puntos marcados (bar, length_m), para la escala.</translation>
    </message>
    <message>
      <source>Calibration</source>
      <translation>Calibración</translation>
    </message>
    <message>
      <source>camera.json of an earlier reconstruction with the same camera and photo size; without it the lens is taken from the photos' metadata.</source>
      <translation>camera.json de una reconstrucción anterior con la misma cámara y tamaño de foto; si falta, valen los datos de la lente de los metadatos de las fotos.</translation>
    </message>
    <message>
      <source>Field stems</source>
      <translation>Troncos de campo</translation>
    </message>
    <message>
      <source>Stems that a field crew knows: a point layer, or CSV with x, y or lon, lat and tree_id; each that the search does not find by itself is looked for at its place, and ends as a tree or with the reason why not.</source>
      <translation>Fustes que una cuadrilla de campo conoce: una capa de puntos o un CSV con x, y o lon, lat y tree_id; cada uno que la búsqueda no encuentra por sí misma se busca en su lugar y termina como árbol o con el motivo por el que no.</translation>
    </message>
    <message>
      <source>Field error [m]</source>
      <translation>Error de campo [m]</translation>
    </message>
    <message>
      <source>How far a place of --field-stems or --at may be from its stem.</source>
      <translation>A qué distancia de su fuste puede estar un lugar de --field-stems o --at.</translation>
    </message>
    <message>
      <source>Only at these points of a finished run</source>
      <translation>Solo en estos puntos de una ejecución terminada</translation>
    </message>
    <message>
      <source>Measure the stems at these points (layer or CSV as for --field-stems) from the finished run in the workspace, in seconds, and add them to its tree layer; the other settings have to be those of that run. A point named 'again 12' measures tree 12 anew with its foot there, 'former 12' takes that back.</source>
      <translation>Mide los fustes en estos puntos (capa o CSV como en --field-stems) a partir de la ejecución terminada en la carpeta de trabajo, en segundos, y los añade a su capa de árboles; los demás ajustes tienen que ser los de esa ejecución. Un punto llamado 'again 12' mide de nuevo el árbol 12 con el pie ahí; 'former 12' lo deshace.</translation>
    </message>
    <message>
      <source>Flight plan (plan.gpkg of plan-flight) that was flown: planned and got are compared.</source>
      <translation>Plan de vuelo (plan.gpkg de plan-flight) que se voló: se compara lo planeado con lo obtenido.</translation>
    </message>
    <message>
      <source>Preset</source>
      <translation>Preajuste</translation>
    </message>
    <message>
      <source>How much is modelled: fast and best differ in photos and features used; paper = the published method on the whole plot (hours).</source>
      <translation>Cuánto se modela: fast y best difieren en las fotos y los rasgos usados; paper = el método publicado en toda la parcela (horas).</translation>
    </message>
    <message>
      <source>Way of measuring</source>
      <translation>Modo de medir</translation>
    </message>
    <message>
      <source>auto, photos = stems fitted straight to the photos; gaussians, paper = the published method.</source>
      <translation>auto, photos = troncos ajustados directamente en las fotos; gaussians, paper = el método publicado.</translation>
    </message>
    <message>
      <source>Time limit [min]</source>
      <translation>Límite de tiempo [min]</translation>
    </message>
    <message>
      <source>Of the published method: CPU time that fitting Gaussians over the whole plot may take; a short one means fewer steps and smaller photos, and the report says how far it came.</source>
      <translation>Del método publicado: tiempo de CPU que puede tomar el ajuste de gaussianas en toda la parcela; uno corto significa menos pasos y fotos más pequeñas, y el informe dice hasta dónde llegó.</translation>
    </message>
    <message>
      <source>Device</source>
      <translation>Dispositivo</translation>
    </message>
    <message>
      <source>Of the published method: where the Gaussians are fitted; cuda = an NVIDIA GPU, through the packages warp-lang and torch (its CUDA build); the time limit then counts by the clock.</source>
      <translation>Del método publicado: dónde se ajustan las gaussianas; cuda = una GPU de NVIDIA, mediante los paquetes warp-lang y torch (en su versión CUDA); el límite de tiempo cuenta entonces por el reloj.</translation>
    </message>
    <message>
      <source>Dense</source>
      <translation>Densificar</translation>
    </message>
    <message>
      <source>Of the published method: points to start the Gaussians from, OpenMVS's scene_dense.ply made from the workspace's sfm folder, or LAS/LAZ in the project CRS; without it our own stereo makes them.</source>
      <translation>Del método publicado: puntos con los que empiezan las gaussianas, scene_dense.ply de OpenMVS hecho con la carpeta sfm del espacio de trabajo, o LAS/LAZ en el SRC del proyecto; sin ellos los hace nuestro propio estéreo.</translation>
    </message>
    <message>
      <source>Breast height [m]</source>
      <translation>Altura del pecho [m]</translation>
    </message>
    <message>
      <source>Breast height above ground.</source>
      <translation>Altura del pecho sobre el suelo.</translation>
    </message>
    <message>
      <source>Max DBH [cm]</source>
      <translation>DAP máximo [cm]</translation>
    </message>
    <message>
      <source>Thickest stem that is looked for; thicker ones are refused as too large.</source>
      <translation>El fuste más grueso que se busca; los más gruesos se rechazan como too_large.</translation>
    </message>
    <message>
      <source>Evidence sheets (a picture a tree)</source>
      <translation>Hojas de evidencia (una imagen por árbol)</translation>
    </message>
    <message>
      <source>Evidence sheets, one small picture a tree: of all trees, of those to check and not measured, or none; auto = as the preset: those to check with fast, all otherwise.</source>
      <translation>Hojas de evidencia, una imagen pequeña por árbol: de todos los árboles, de los que hay que revisar y los no medidos, o ninguna; auto = según el ajuste: con fast las que hay que revisar, si no todas.</translation>
    </message>
    <message>
      <source>Heights</source>
      <translation>Alturas</translation>
    </message>
    <message>
      <source>Tree heights and a canopy height model (chm.tif) from the photos; auto = as the preset: not with fast.</source>
      <translation>Alturas de los árboles y un modelo de altura del dosel (chm.tif) a partir de las fotos; auto = según el ajuste: no con fast.</translation>
    </message>
    <message>
      <source>Orthophoto of the ground below the crowns</source>
      <translation>Ortofoto del suelo bajo las copas</translation>
    </message>
    <message>
      <source>Write the orthophoto of the ground below the crowns (ortho.tif): each place from the photos that see it; a few seconds a plot.</source>
      <translation>Escribe la ortofoto del suelo bajo las copas (ortho.tif): cada lugar a partir de las fotos que lo ven; unos segundos por parcela.</translation>
    </message>
    <message>
      <source>Stem network</source>
      <translation>Red de troncos</translation>
    </message>
    <message>
      <source>A small network, trained on simulated photos, is asked which pixels show stems and ivy: auto = where the photos show the ground behind the stems; off = never.</source>
      <translation>Se pregunta a una pequeña red, entrenada con fotos simuladas, qué píxeles muestran troncos y hiedra: auto = donde las fotos muestran el suelo detrás de los troncos; off = nunca.</translation>
    </message>
    <message>
      <source>tree layer (file)</source>
      <translation>capa de árboles (archivo)</translation>
    </message>
    <message>
      <source>HTML report (file)</source>
      <translation>informe HTML (archivo)</translation>
    </message>
    <message>
      <source>folder of the results</source>
      <translation>carpeta de resultados</translation>
    </message>
    <message>
      <source>run.json: parameters, versions, seconds, peak memory (file)</source>
      <translation>run.json: parámetros, versiones, segundos, memoria máxima (archivo)</translation>
    </message>
    <message>
      <source>stems found</source>
      <translation>troncos encontrados</translation>
    </message>
    <message>
      <source>stems with a DBH</source>
      <translation>troncos con DAP</translation>
    </message>
    <message>
      <source>stems without one, each with a reason</source>
      <translation>troncos sin DAP, cada uno con un motivo</translation>
    </message>
    <message>
      <source>mean DBH of the measured stems, cm</source>
      <translation>DAP medio de los troncos medidos, cm</translation>
    </message>
    <message>
      <source>photos that can be used (dry run)</source>
      <translation>fotos utilizables (ensayo)</translation>
    </message>
    <message>
      <source>photos with a fixed position, % (dry run)</source>
      <translation>fotos con posición fija, % (ensayo)</translation>
    </message>
    <message>
      <source>ground that neighbouring photos share, % (dry run)</source>
      <translation>suelo común de fotos vecinas, % (ensayo)</translation>
    </message>
    <message>
      <source>tiles that are searched for stems (dry run)</source>
      <translation>teselas en las que se buscan troncos (ensayo)</translation>
    </message>
    <message>
      <source>estimated time, s (dry run)</source>
      <translation>tiempo estimado, s (ensayo)</translation>
    </message>
    <message>
      <source>estimated memory, GB (dry run)</source>
      <translation>memoria estimada, GB (ensayo)</translation>
    </message>
    <message>
      <source>estimated disk, GB (dry run)</source>
      <translation>disco estimado, GB (ensayo)</translation>
    </message>
    <message>
      <source>what came out, in one sentence</source>
      <translation>lo que resultó, en una frase</translation>
    </message>
    <message>
      <source>Measure DBH from a point cloud</source>
      <translation>Medir el DAP en una nube de puntos</translation>
    </message>
    <message>
      <source>From a LiDAR cloud (drone or terrestrial) or surface points to tree points with DBH.</source>
      <translation>De una nube LiDAR (dron o terrestre) o puntos de superficie a puntos de árbol con DAP.</translation>
    </message>
    <message>
      <source>Finds the ground (or takes your DTM), finds the stems in the band from 0.5 to 5 m, measures each at breast height and writes the tree layer: DBH, standard error and 90 % interval in cm, lean, height where the cloud reaches the crowns, and for every stem that cannot be measured the reason. Needs about 100 points on the lower 3 m of a stem (drone LiDAR above 1,000 points/m2, or a terrestrial scan). The CRS comes from the file; give --crs where it has none ('local' for a scan without a place on the map). Errors and limits were calibrated on rendered and simulated plots, mostly pines; no photo of a tree that somebody taped has been measured yet. Tape some trees: they say how right the diameters are.</source>
      <translation>Busca el suelo (o toma su MDT), busca los troncos en la banda de 0,5 a 5 m, mide cada uno a la altura del pecho y escribe la capa de árboles: DAP, error estándar e intervalo del 90 % en cm, inclinación, altura donde la nube llega a las copas, y el motivo para cada tronco que no se puede medir. Necesita unos 100 puntos en los 3 m inferiores de un tronco (LiDAR de dron con más de 1000 puntos/m2, o un escaneo terrestre). El SRC viene del archivo; dé --crs si no lo tiene ('local' para un escaneo sin lugar en el mapa). Los errores y los límites se calibraron en parcelas renderizadas y simuladas, en su mayoría de pinos; aún no se ha medido ninguna foto de un árbol que alguien midiera con cinta. Mida algunos árboles con cinta: dicen cuán correctos son los diámetros.</translation>
    </message>
    <message>
      <source>Point cloud</source>
      <translation>Nube de puntos</translation>
    </message>
    <message>
      <source>point cloud: LAS, LAZ, COPC, E57, or text with x y z per line</source>
      <translation>nube de puntos: LAS, LAZ, COPC, E57 o texto con x y z por línea</translation>
    </message>
    <message>
      <source>CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); only stems in them are measured, without it those of the whole cloud</source>
      <translation>CSV de parcelas: plot_id, easting, northing, radius_m (o lon, lat); solo se miden los fustes dentro de ellas, sin ella los de toda la nube</translation>
    </message>
    <message>
      <source>terrain raster; without it the ground is found in the cloud</source>
      <translation>ráster del terreno; si falta, el suelo se busca en la nube</translation>
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local' for metres without a place on the map</source>
      <translation>SRC de una nube que no lo contiene: EPSG:CÓDIGO, o 'local' para metros sin lugar en el mapa</translation>
    </message>
    <message>
      <source>Only check the cloud, its CRS, density and DTM, memory and disk, and estimate the time; writes nothing</source>
      <translation>Solo comprueba la nube, su SRC, densidad y MDT, memoria y disco, y estima el tiempo; no escribe nada</translation>
    </message>
    <message>
      <source>tree layer</source>
      <translation>capa de árboles</translation>
    </message>
    <message>
      <source>Report</source>
      <translation>Informe</translation>
    </message>
    <message>
      <source>also write a report: map, each DBH, what the cloud did not show, cost</source>
      <translation>escribir también un informe: mapa, cada DAP, lo que la nube no mostró, coste</translation>
    </message>
    <message>
      <source>Z is</source>
      <translation>Z es</translation>
    </message>
    <message>
      <source>what z is: elevation, or height above ground (a normalised cloud); auto = read from the points</source>
      <translation>qué es z: cota, o altura sobre el suelo (una nube normalizada); auto = se lee de los puntos</translation>
    </message>
    <message>
      <source>Reliability of points</source>
      <translation>Fiabilidad de los puntos</translation>
    </message>
    <message>
      <source>reliability of the points: none, LiDAR intensity, or opacity of surface points</source>
      <translation>fiabilidad de los puntos: ninguna, intensidad LiDAR u opacidad de puntos de superficie</translation>
    </message>
    <message>
      <source>cross-section model</source>
      <translation>modelo de la sección</translation>
    </message>
    <message>
      <source>Method</source>
      <translation>Método</translation>
    </message>
    <message>
      <source>default = our estimator; paper = the published constants</source>
      <translation>default = nuestro estimador; paper = las constantes publicadas</translation>
    </message>
    <message>
      <source>breast height</source>
      <translation>altura del pecho</translation>
    </message>
    <message>
      <source>Min DBH [cm]</source>
      <translation>DAP mínimo [cm]</translation>
    </message>
    <message>
      <source>thinner stems are refused as too small</source>
      <translation>los troncos más finos se rechazan</translation>
    </message>
    <message>
      <source>thicker stems are refused as too large</source>
      <translation>los troncos más gruesos se rechazan</translation>
    </message>
    <message>
      <source>Source</source>
      <translation>Origen de los puntos</translation>
    </message>
    <message>
      <source>what made the points</source>
      <translation>qué produjo los puntos</translation>
    </message>
    <message>
      <source>Evidence sheets, one small picture a tree: of all trees, of those to check and not measured, or none; auto = those to check and not measured.</source>
      <translation>Hojas de evidencia, una imagen pequeña por árbol: de todos los árboles, de los que hay que revisar y los no medidos, o ninguna; auto = las que hay que revisar y las no medidas.</translation>
    </message>
    <message>
      <source>the page to open</source>
      <translation>la página que se abre</translation>
    </message>
    <message>
      <source>stems in the layer</source>
      <translation>troncos en la capa</translation>
    </message>
    <message>
      <source>without remark</source>
      <translation>sin observaciones</translation>
    </message>
    <message>
      <source>to check</source>
      <translation>por revisar</translation>
    </message>
    <message>
      <source>refused</source>
      <translation>rechazados</translation>
    </message>
    <message>
      <source>mean DBH, cm</source>
      <translation>DAP medio, cm</translation>
    </message>
    <message>
      <source>points (dry run)</source>
      <translation>puntos (ensayo)</translation>
    </message>
    <message>
      <source>points a square metre (dry run)</source>
      <translation>puntos por metro cuadrado (ensayo)</translation>
    </message>
    <message>
      <source>verdict (dry run)</source>
      <translation>veredicto (ensayo)</translation>
    </message>
    <message>
      <source>Measure many plots</source>
      <translation>Medir muchas parcelas</translation>
    </message>
    <message>
      <source>Many plots from one table, on this machine or several: one trees layer, one report.</source>
      <translation>Muchas parcelas de una tabla, en este equipo o en varios: una capa de árboles, un informe.</translation>
    </message>
    <message>
      <source>One row of the table is one plot, from photos or from a point cloud. All rows are checked before anything starts. Plots run side by side, as many as memory and cores carry, each in a folder of its own; a plot that fails is tried again at most twice and then reported, the others go on. A second start runs only what is missing or whose inputs or settings have changed. Writes one trees layer with plot ids, campaign.html and plots.csv (trees, refusals and reasons, seconds, memory, accuracy where field trees are given). Where plots failed it ends with an error (exit code 5) although layer and report are written. With --predict it only says how long it will take.</source>
      <translation>Una fila de la tabla es una parcela, a partir de fotos o de una nube de puntos. Todas las filas se comprueban antes de empezar. Las parcelas van en paralelo, tantas como permitan memoria y núcleos, cada una en su carpeta; la que falla se repite como mucho dos veces y luego se comunica, las demás siguen. Un segundo inicio solo ejecuta lo que falta o aquello cuyas entradas o ajustes cambiaron. Escribe una capa de árboles con identificador de parcela, campaign.html y plots.csv (árboles, rechazos y motivos, segundos, memoria, exactitud donde hay árboles de campo). Donde fallaron parcelas termina con un error (código de salida 5), aunque la capa y el informe estén escritos. Con --predict solo dice cuánto tardará.</translation>
    </message>
    <message>
      <source>Manifest</source>
      <translation>Tabla de parcelas</translation>
    </message>
    <message>
      <source>CSV with one row a plot: plot_id, photos (folder) or cloud (file), and where wanted geotags, dtm, crs, plots, field and any setting of the verb by its name; paths count from the table's folder</source>
      <translation>CSV con una fila por parcela: plot_id, photos (carpeta) o cloud (archivo), y si se quiere geotags, dtm, crs, plots, field y cualquier ajuste de la orden por su nombre; las rutas parten de la carpeta de la tabla</translation>
    </message>
    <message>
      <source>CRS of rows that give none, and of the layer when rows have different ones</source>
      <translation>SRC de las filas que no dan ninguno, y de la capa cuando las filas tienen distintos</translation>
    </message>
    <message>
      <source>Workers</source>
      <translation>Procesos de trabajo</translation>
    </message>
    <message>
      <source>plots at once; 0 = as many as cores and memory carry</source>
      <translation>parcelas a la vez; 0 = tantas como permitan núcleos y memoria</translation>
    </message>
    <message>
      <source>Predict</source>
      <translation>Predicción</translation>
    </message>
    <message>
      <source>only check the table and say how long it will take and what it needs</source>
      <translation>solo comprobar la tabla y decir cuánto tardará y qué necesita</translation>
    </message>
    <message>
      <source>folder for the campaign; a second start does what is missing</source>
      <translation>carpeta de la campaña; un segundo inicio hace lo que falta</translation>
    </message>
    <message>
      <source>the one trees layer (.gpkg or .csv); without it trees.gpkg in the workspace</source>
      <translation>la única capa de árboles (.gpkg o .csv); si falta, trees.gpkg en la carpeta de trabajo</translation>
    </message>
    <message>
      <source>Threads</source>
      <translation>Hilos</translation>
    </message>
    <message>
      <source>processor threads a plot</source>
      <translation>hilos por parcela</translation>
    </message>
    <message>
      <source>Memory [GB]</source>
      <translation>Memoria [GB]</translation>
    </message>
    <message>
      <source>memory for all plots together; 0 = what is free, less a reserve</source>
      <translation>memoria para todas las parcelas juntas; 0 = la que está libre, menos una reserva</translation>
    </message>
    <message>
      <source>trees layer of all plots (file)</source>
      <translation>capa de árboles de todas las parcelas (archivo)</translation>
    </message>
    <message>
      <source>campaign report (file)</source>
      <translation>informe de la campaña (archivo)</translation>
    </message>
    <message>
      <source>one row a plot (file)</source>
      <translation>una fila por parcela (archivo)</translation>
    </message>
    <message>
      <source>plots in the table</source>
      <translation>parcelas de la tabla</translation>
    </message>
    <message>
      <source>plots measured, now or before</source>
      <translation>parcelas medidas, ahora o antes</translation>
    </message>
    <message>
      <source>plots run by this start</source>
      <translation>parcelas ejecutadas en este inicio</translation>
    </message>
    <message>
      <source>plots kept from an earlier start</source>
      <translation>parcelas conservadas de un inicio anterior</translation>
    </message>
    <message>
      <source>plots given up, each with its reason in the report</source>
      <translation>parcelas abandonadas, cada una con su motivo en el informe</translation>
    </message>
    <message>
      <source>seconds of this start</source>
      <translation>segundos de este inicio</translation>
    </message>
    <message>
      <source>seconds that were forecast</source>
      <translation>segundos previstos</translation>
    </message>
    <message>
      <source>Geotag drone photos</source>
      <translation>Geoetiquetar fotos de dron</translation>
    </message>
    <message>
      <source>5 Steps and research</source>
      <translation>5 Pasos e investigación</translation>
    </message>
    <message>
      <source>MRK and RTKLIB .pos (or EXIF/XMP) to camera positions at the exposure, as a point layer.</source>
      <translation>De MRK y .pos de RTKLIB (o EXIF/XMP) a posiciones de cámara en el disparo, como capa de puntos.</translation>
    </message>
    <message>
      <source>Inputs: the photos, and a folder with the drone's Timestamp.MRK and the PPK solution (.pos), or a CSV by photo name. RINEX of rover and base is solved by RTKLIB (rnx2rtkp). The antenna's path is interpolated at each exposure and the lever arm applied once; heights stay ellipsoidal unless the project CRS has a height datum, which needs its geoid grid. Output: layer 'stations' (PointZ, project CRS) with quality (fix, float, single, exif, none), standard deviations (m), time, flight and gimbal angles (degrees). Photos that are blurred or show nothing are left out with a warning; geotags of other photos are refused.</source>
      <translation>Entradas: las fotos, y una carpeta con el Timestamp.MRK del dron y la solución PPK (.pos), o un CSV por nombre de foto. El RINEX de móvil y base lo resuelve RTKLIB (rnx2rtkp). La trayectoria de la antena se interpola en cada disparo y el brazo de palanca se aplica una vez; las alturas quedan elipsoidales salvo que el SRC del proyecto tenga un datum vertical, que necesita su malla de geoide. Salida: capa 'stations' (PointZ, SRC del proyecto) con calidad (fix, float, single, exif, none), desviaciones estándar (m), hora, vuelo y ángulos del cardán (grados). Las fotos borrosas o vacías se omiten con un aviso; las geoetiquetas de otras fotos se rechazan.</translation>
    </message>
    <message>
      <source>Folder with the original drone photos (searched with its subfolders).</source>
      <translation>Carpeta con las fotos originales del dron (se busca también en sus subcarpetas).</translation>
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos or RINEX (PPK), or a CSV with name, lat, lon, h; without it EXIF/XMP positions are used.</source>
      <translation>Carpeta o archivo con MRK y .pos de RTKLIB o RINEX (PPK), o un CSV con name, lat, lon, h; si falta, valen las posiciones EXIF/XMP.</translation>
    </message>
    <message>
      <source>Camera stations layer to write.</source>
      <translation>Capa de estaciones de cámara que se escribe.</translation>
    </message>
    <message>
      <source>Base</source>
      <translation>Base</translation>
    </message>
    <message>
      <source>RINEX observations of the base station, when they do not lie with the geotags.</source>
      <translation>Observaciones RINEX de la estación base, cuando no están junto a las geoetiquetas.</translation>
    </message>
    <message>
      <source>Base position</source>
      <translation>Posición de la base</translation>
    </message>
    <message>
      <source>Base station 'latitude, longitude, height' (degrees, ellipsoidal m), for RINEX; default: its header's.</source>
      <translation>Estación base 'latitud, longitud, altura' (grados, m elipsoidales), para RINEX; por defecto, la de su cabecera.</translation>
    </message>
    <message>
      <source>Tagged photos</source>
      <translation>Fotos geoetiquetadas</translation>
    </message>
    <message>
      <source>New folder for copies of the photos with the corrected EXIF/XMP position; originals are never changed.</source>
      <translation>Carpeta nueva para copias de las fotos con la posición EXIF/XMP corregida; los originales nunca se cambian.</translation>
    </message>
    <message>
      <source>Camera delay [ms]</source>
      <translation>Retardo de la cámara [ms]</translation>
    </message>
    <message>
      <source>Exposure minus mark time, for cameras triggered by cable.</source>
      <translation>Disparo menos hora de la marca, para cámaras accionadas por cable.</translation>
    </message>
    <message>
      <source>camera stations layer (file)</source>
      <translation>capa de estaciones de cámara (archivo)</translation>
    </message>
    <message>
      <source>photos with a fixed PPK/RTK position</source>
      <translation>fotos con posición PPK/RTK fija</translation>
    </message>
    <message>
      <source>photos with a float position</source>
      <translation>fotos con posición flotante</translation>
    </message>
    <message>
      <source>photos with a navigation-grade position</source>
      <translation>fotos con posición de calidad de navegación</translation>
    </message>
    <message>
      <source>photos without a position</source>
      <translation>fotos sin posición</translation>
    </message>
    <message>
      <source>flights</source>
      <translation>vuelos</translation>
    </message>
    <message>
      <source>tagged copies written</source>
      <translation>copias geoetiquetadas escritas</translation>
    </message>
    <message>
      <source>Reconstruct cameras from photos</source>
      <translation>Reconstruir cámaras a partir de fotos</translation>
    </message>
    <message>
      <source>Georeferenced structure from motion: camera poses, sparse points, dense points of the stem band.</source>
      <translation>Estructura a partir del movimiento georreferenciada: poses de cámara, puntos dispersos, puntos densos de la banda de troncos.</translation>
    </message>
    <message>
      <source>Inputs: overlapping drone photos (80 % overlap, most of them oblique) and their PPK, RTK or EXIF positions, or three or more control points. All flights end in one frame, adjusted with the geotags as priors. Output in the workspace: geotags.gpkg, sfm/ (COLMAP model in a local frame, frame.json with the CRS and origin, report.json) and dense.laz (stem band of the plots, project CRS). A block that contradicts its geotags, the lens calibration in the metadata, or the flying height is refused.</source>
      <translation>Entradas: fotos de dron con solape (80 %, la mayoría oblicuas) y sus posiciones PPK, RTK o EXIF, o tres o más puntos de control. Todos los vuelos acaban en un mismo marco, ajustado con las geoetiquetas como información previa. Salida en la carpeta de trabajo: geotags.gpkg, sfm/ (modelo COLMAP en un marco local, frame.json con el SRC y el origen, report.json) y dense.laz (banda de troncos de las parcelas, SRC del proyecto). Se rechaza un bloque que contradiga sus geoetiquetas, la calibración de la lente en los metadatos o la altura de vuelo.</translation>
    </message>
    <message>
      <source>Make dense points of the stem band where plots are given.</source>
      <translation>Hacer puntos densos de la banda de troncos donde se dan parcelas.</translation>
    </message>
    <message>
      <source>COLMAP model (folder)</source>
      <translation>modelo COLMAP (carpeta)</translation>
    </message>
    <message>
      <source>dense points of the stem band (file)</source>
      <translation>puntos densos de la banda de troncos (archivo)</translation>
    </message>
    <message>
      <source>photos registered</source>
      <translation>fotos registradas</translation>
    </message>
    <message>
      <source>RMS reprojection error, px</source>
      <translation>error de reproyección RMS, px</translation>
    </message>
    <message>
      <source>RMS distance of cameras to their geotags, E, N, U, m</source>
      <translation>distancia RMS de las cámaras a sus geoetiquetas, E, N, h, m</translation>
    </message>
    <message>
      <source>RMS distance of the block to control points, E, N, U, m</source>
      <translation>Distancia cuadrática media del bloque a los puntos de control, E, N, U, m</translation>
    </message>
    <message>
      <source>RMS distance of the block to check points, E, N, U, m</source>
      <translation>Distancia cuadrática media del bloque a los puntos de comprobación, E, N, U, m</translation>
    </message>
    <message>
      <source>focal length, px</source>
      <translation>distancia focal, px</translation>
    </message>
    <message>
      <source>sparse points</source>
      <translation>puntos dispersos</translation>
    </message>
    <message>
      <source>dense points</source>
      <translation>puntos densos</translation>
    </message>
    <message>
      <source>seconds of structure from motion</source>
      <translation>segundos de estructura a partir del movimiento</translation>
    </message>
    <message>
      <source>Terrain model from a point cloud</source>
      <translation>Modelo del terreno de una nube de puntos</translation>
    </message>
    <message>
      <source>Find the ground in a point cloud and write a terrain model (DTM).</source>
      <translation>Buscar el suelo en una nube de puntos y escribir un modelo del terreno (MDT).</translation>
    </message>
    <message>
      <source>A cloth is draped over the lowest points (cloth simulation filter), low plants are removed by a robust surface, and the ground is gridded by local planes. The GeoTIFF holds the ground height (band 1, metres, in the cloud's vertical datum) and the distance to the nearest ground point (band 2): read band 2 before you trust band 1. Cells farther than 10 m from ground are nodata.</source>
      <translation>Se tiende una tela sobre los puntos más bajos (cloth simulation filter), las plantas bajas se quitan con una superficie robusta y el suelo se interpola con planos locales. El GeoTIFF contiene la altura del suelo (banda 1, metros, en el datum vertical de la nube) y la distancia al punto de suelo más cercano (banda 2): lea la banda 2 antes de fiarse de la banda 1. Las celdas a más de 10 m del suelo no tienen dato.</translation>
    </message>
    <message>
      <source>terrain raster to write</source>
      <translation>ráster del terreno que se escribe</translation>
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local'</source>
      <translation>SRC de una nube que no lo contiene: EPSG:CÓDIGO, o 'local'</translation>
    </message>
    <message>
      <source>Resolution [m]</source>
      <translation>Resolución [m]</translation>
    </message>
    <message>
      <source>cell size</source>
      <translation>tamaño de celda</translation>
    </message>
    <message>
      <source>Ground points</source>
      <translation>Puntos del suelo</translation>
    </message>
    <message>
      <source>also write the cloud, ground points as class 2 and heights above ground</source>
      <translation>escribe también la nube, puntos del suelo como clase 2 y alturas sobre el suelo</translation>
    </message>
    <message>
      <source>Use classes</source>
      <translation>Usar las clases</translation>
    </message>
    <message>
      <source>trust the file's class 2 instead of finding the ground</source>
      <translation>fiarse de la clase 2 del archivo en vez de buscar el suelo</translation>
    </message>
    <message>
      <source>Cloth [m]</source>
      <translation>Tela [m]</translation>
    </message>
    <message>
      <source>cell size of the cloth</source>
      <translation>tamaño de malla de la tela</translation>
    </message>
    <message>
      <source>Rigidness</source>
      <translation>Rigidez</translation>
    </message>
    <message>
      <source>1 steep, 2 hilly, 3 flat terrain</source>
      <translation>1 terreno empinado, 2 ondulado, 3 llano</translation>
    </message>
    <message>
      <source>Threshold [m]</source>
      <translation>Umbral [m]</translation>
    </message>
    <message>
      <source>largest distance of ground points from the cloth</source>
      <translation>mayor distancia de los puntos del suelo a la tela</translation>
    </message>
    <message>
      <source>terrain raster</source>
      <translation>ráster del terreno</translation>
    </message>
    <message>
      <source>points used</source>
      <translation>puntos usados</translation>
    </message>
    <message>
      <source>ground points among them</source>
      <translation>de ellos, puntos del suelo</translation>
    </message>
    <message>
      <source>share of the extent with a ground height, %</source>
      <translation>parte de la extensión con altura del suelo, %</translation>
    </message>
    <message>
      <source>distance to the nearest ground point that 95 % of the cells stay under, m</source>
      <translation>distancia al punto de suelo más cercano bajo la que queda el 95 % de las celdas, m</translation>
    </message>
    <message>
      <source>classified cloud</source>
      <translation>nube clasificada</translation>
    </message>
    <message>
      <source>Fit Gaussians to a plot</source>
      <translation>Ajustar gaussianas a una parcela</translation>
    </message>
    <message>
      <source>3D Gaussians over the whole plot, fitted to all photos as published.</source>
      <translation>Gaussianas 3D sobre toda la parcela, ajustadas a todas las fotos como se publicó.</translation>
    </message>
    <message>
      <source>The first step of the published method, which photos-to-dbh --preset paper runs as a whole; sample-surface, segment-stems and measure-dbh are the others. Needs a workspace with a reconstruction (sfm/) and a terrain model (dtm.tif), and the package torch. Output: field.ply, Gaussians in the standard 3DGS format and local metres (its origin and CRS are in field.frame.json beside it). A short --time-limit means fewer steps and smaller photos; run.json says how far the fit came.</source>
      <translation>El primer paso del método publicado, que photos-to-dbh --preset paper ejecuta entero; sample-surface, segment-stems y measure-dbh son los demás. Necesita una carpeta de trabajo con una reconstrucción (sfm/) y un modelo del terreno (dtm.tif), y el paquete torch. Resultado: field.ply, gaussianas en el formato 3DGS habitual y en metros locales (su origen y su SRC están al lado, en field.frame.json). Un --time-limit corto significa menos pasos y fotos más pequeñas; run.json dice hasta dónde llegó el ajuste.</translation>
    </message>
    <message>
      <source>Workspace with sfm/ and dtm.tif; field.ply is written there.</source>
      <translation>Carpeta de trabajo con sfm/ y dtm.tif; ahí se escribe field.ply.</translation>
    </message>
    <message>
      <source>Folder of the reconstructed photos; without it the one in run.json.</source>
      <translation>Carpeta de las fotos reconstruidas; si falta, la de run.json.</translation>
    </message>
    <message>
      <source>Gaussian field (3DGS PLY, local metres)</source>
      <translation>campo de gaussianas (PLY 3DGS, metros locales)</translation>
    </message>
    <message>
      <source>number of Gaussians</source>
      <translation>número de gaussianas</translation>
    </message>
    <message>
      <source>Sample surface points from Gaussians</source>
      <translation>Muestrear puntos de superficie de las gaussianas</translation>
    </message>
    <message>
      <source>Points drawn inside the Gaussians, each with its opacity reliability over the photos.</source>
      <translation>Puntos dentro de las gaussianas, cada uno con la fiabilidad de su opacidad en las fotos.</translation>
    </message>
    <message>
      <source>Needs a workspace with field.ply (fit-gaussians), and the package torch. Draws up to M points inside each Gaussian, thinned by its opacity, and scores each by the opacity in front of it in every photo: the smallest over the photos that show Gaussians there is kept. Output: surface.laz in the project CRS with the extra dimensions opacity (0..1) and n_views (photos that show Gaussians there).</source>
      <translation>Necesita una carpeta de trabajo con field.ply (fit-gaussians), y el paquete torch. Toma hasta M puntos dentro de cada gaussiana, reducidos según su opacidad, y puntúa cada uno por la opacidad que tiene delante en cada foto: se conserva la menor de las fotos que muestran gaussianas allí. Resultado: surface.laz en el SRC del proyecto con las dimensiones adicionales opacity (0..1) y n_views (fotos que muestran gaussianas allí).</translation>
    </message>
    <message>
      <source>Workspace with sfm/ and field.ply; surface.laz is written there.</source>
      <translation>Carpeta de trabajo con sfm/ y field.ply; ahí se escribe surface.laz.</translation>
    </message>
    <message>
      <source>surface points (LAZ with opacity, n_views)</source>
      <translation>puntos de superficie (LAZ con opacity, n_views)</translation>
    </message>
    <message>
      <source>number of points</source>
      <translation>número de puntos</translation>
    </message>
    <message>
      <source>Find stems in a point cloud</source>
      <translation>Buscar troncos en una nube de puntos</translation>
    </message>
    <message>
      <source>Find stems in a point cloud and give each point the id of its tree.</source>
      <translation>Buscar troncos en una nube de puntos y dar a cada punto el identificador de su árbol.</translation>
    </message>
    <message>
      <source>Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem), height_m, stem_class (0 other, 1 ground, 2 stem) and ground_se_m (how sure the ground under the tree is, 99 = not seen at all). --segmenter runs a program that you installed instead and checks that its labels belong to the points it was given. --field-stems gives known positions: near them weaker evidence is looked at, and the stems found carry the field's tree_id: pairs are one to one, as near as the positions are exact, 1 m at most. OUTPUT_field.csv answers for each: found, unsure (the stem near it may be another's), refused or missing, with the reason.</source>
      <translation>Busca en la banda de 0,5 a 5 m sobre el suelo anillos (o discos, en puntos de superficie de splats) que se repitan con la altura, ajusta a cada uno un cono inclinado con ahusamiento, conserva lo que es vacío por dentro, limpio por fuera y continuo, y sigue el eje hacia arriba. Sin pesos aprendidos. La salida lleva tree_id (0 = ningún tronco), height_m, stem_class (0 otro, 1 suelo, 2 tronco) y ground_se_m (lo seguro que es el suelo bajo el árbol, 99 = no se ve). --segmenter ejecuta en su lugar un programa que usted instaló y comprueba que sus etiquetas correspondan a los puntos entregados. --field-stems da posiciones conocidas: cerca de ellas se miran indicios más débiles, y los troncos hallados llevan el tree_id de campo: las parejas son de uno a uno, tan cercanas como exactas sean las posiciones, 1 m como máximo. OUTPUT_field.csv responde por cada uno: found, unsure (el tronco cercano puede ser de otro), refused o missing, con el motivo.</translation>
    </message>
    <message>
      <source>stem points with tree_id</source>
      <translation>puntos del tronco con tree_id</translation>
    </message>
    <message>
      <source>Keep all</source>
      <translation>Conservar todos</translation>
    </message>
    <message>
      <source>write every point (tree_id 0 = no stem), not only stem points</source>
      <translation>escribir todos los puntos (tree_id 0 = ningún tronco), no solo los del tronco</translation>
    </message>
    <message>
      <source>positions of known stems (point layer, or CSV with x, y, tree_id): they are looked for harder, and name what is found</source>
      <translation>posiciones de troncos conocidos (capa de puntos, o CSV con x, y, tree_id): se buscan con más empeño y dan nombre a lo hallado</translation>
    </message>
    <message>
      <source>thickest stem</source>
      <translation>tronco más grueso</translation>
    </message>
    <message>
      <source>Segmenter</source>
      <translation>Segmentador</translation>
    </message>
    <message>
      <source>who finds the trees: own needs nothing; forestformer3d, segmentanytree and treex are programs that you installed yourself (docs/analyst/measuring.md)</source>
      <translation>quién encuentra los árboles: own no necesita nada; forestformer3d, segmentanytree y treex son programas que usted mismo instaló (docs/analyst/measuring.md)</translation>
    </message>
    <message>
      <source>Segmenter command</source>
      <translation>Orden del segmentador</translation>
    </message>
    <message>
      <source>command line of that program, with {input} and {output} for its folders</source>
      <translation>línea de órdenes de ese programa, con {input} y {output} para sus carpetas</translation>
    </message>
    <message>
      <source>stem points with tree_id and height_m</source>
      <translation>puntos del tronco con tree_id y height_m</translation>
    </message>
    <message>
      <source>points on stems</source>
      <translation>puntos en troncos</translation>
    </message>
    <message>
      <source>what was found of each field stem</source>
      <translation>qué se halló de cada tronco de campo</translation>
    </message>
    <message>
      <source>settings used: uls, tls, splat, or the segmenter</source>
      <translation>ajustes usados: uls, tls, splat o el segmentador</translation>
    </message>
    <message>
      <source>Measure DBH of segmented stems</source>
      <translation>Medir el DAP de troncos segmentados</translation>
    </message>
    <message>
      <source>Measure the DBH of stems whose points carry tree ids.</source>
      <translation>Medir el DAP de los troncos cuyos puntos llevan identificador de árbol.</translation>
    </message>
    <message>
      <source>Takes a cloud with a tree-id dimension (segment-stems, or another segmenter with --id-field) and writes one point a tree: DBH with its standard error and 90 % interval in cm, at breast height above the ground at the stem. --method paper gives the published estimator (solid circles, taper RANSAC; with --fit cylinder the published cylinder); the default fits a leaning, tapering stem to the bark points. A stem that cannot be measured stays in the layer with qc_flag=reject and the reason.</source>
      <translation>Toma una nube con una dimensión de identificador de árbol (segment-stems, u otro segmentador con --id-field) y escribe un punto por árbol: DAP con su error estándar e intervalo del 90 % en cm, a la altura del pecho sobre el suelo del tronco. --method paper da el estimador publicado (círculos llenos, ahusamiento con RANSAC; con --fit cylinder el cilindro publicado); el valor por defecto ajusta a los puntos de corteza un tronco inclinado con ahusamiento. Un tronco que no se puede medir queda en la capa con qc_flag=reject y el motivo.</translation>
    </message>
    <message>
      <source>ID field</source>
      <translation>Campo del identificador</translation>
    </message>
    <message>
      <source>dimension of the cloud that holds the tree ids</source>
      <translation>dimensión de la nube que contiene los identificadores de árbol</translation>
    </message>
    <message>
      <source>Apply decisions from a table</source>
      <translation>Aplicar decisiones de una tabla</translation>
    </message>
    <message>
      <source>Write a person's decisions on trees into the tree layer, beside the measured values.</source>
      <translation>Escribir las decisiones de una persona sobre los árboles en la capa de árboles, junto a los valores medidos.</translation>
    </message>
    <message>
      <source>Decisions: accept (tree and DBH count as measured), reject (no tree stands here), dbh (the taped diameter counts), merge (the same tree as same_as, which counts), stem (a stem stands here, its DBH is not known; without tree_id: at x, y of the layer's CRS), undo. They go into the columns rev_flag, rev_dbh_cm, rev_note, rev_by and rev_at; what was measured stays as it is. All decisions of a table are written or none. Pairing, evaluation and stand table use them and say how many; measuring again into the same layer keeps them. In QGIS the panel Review trees does the same by mouse.</source>
      <translation>Decisiones: accept (el árbol y su DAP cuentan como se midieron), reject (aquí no hay árbol), dbh (cuenta el diámetro medido con cinta), merge (el mismo árbol que same_as, que es el que cuenta), stem (aquí hay un fuste, su DAP no se conoce; sin tree_id: en x, y del SRC de la capa), undo. Van a las columnas rev_flag, rev_dbh_cm, rev_note, rev_by y rev_at; lo medido queda como está. Se escriben todas las decisiones de una tabla o ninguna. El emparejamiento, la evaluación y la tabla de rodal las usan y dicen cuántas; medir de nuevo en la misma capa las conserva. En QGIS el panel Revisar árboles hace lo mismo con el ratón.</translation>
    </message>
    <message>
      <source>tree layer that the decisions are written into, in columns of their own</source>
      <translation>capa de árboles en la que se escriben las decisiones, en columnas propias</translation>
    </message>
    <message>
      <source>Decisions</source>
      <translation>Decisiones</translation>
    </message>
    <message>
      <source>CSV with tree_id, decision (accept, reject, dbh, merge, stem or undo) and, where needed, dbh_cm, same_as, x, y, note, by, at</source>
      <translation>CSV con tree_id, decision (accept, reject, dbh, merge, stem o undo) y, donde haga falta, dbh_cm, same_as, x, y, note, by, at</translation>
    </message>
    <message>
      <source>DBH unit</source>
      <translation>Unidad del DAP</translation>
    </message>
    <message>
      <source>unit of the DBH column (auto: from a name like dbh_cm)</source>
      <translation>unidad de la columna de DAP (auto: según un nombre como dbh_cm)</translation>
    </message>
    <message>
      <source>decisions written</source>
      <translation>decisiones escritas</translation>
    </message>
    <message>
      <source>stems added</source>
      <translation>fustes añadidos</translation>
    </message>
    <message>
      <source>trees that a person decided on, in all</source>
      <translation>árboles sobre los que decidió una persona, en total</translation>
    </message>
    <message>
      <source>trees to check, or without a DBH, that nobody decided on yet</source>
      <translation>árboles por comprobar, o sin DAP, sobre los que nadie ha decidido aún</translation>
    </message>
    <message>
      <source>Pair field and measured trees</source>
      <translation>Emparejar árboles de campo y medidos</translation>
    </message>
    <message>
      <source>Pair field trees with measured trees by position, as an editable layer.</source>
      <translation>Empareja por posición árboles de campo y medidos, en una capa editable.</translation>
    </message>
    <message>
      <source>Turns bearing and distance into coordinates (true, grid or magnetic north; level or slope distance; to the pith or the face), moves and turns each plot as a whole onto the measured trees, and pairs one to one. DBH is never used to pair, so the pairs can judge it. Where two placings fit about equally well, as in planted rows, the plot is left to you: the layer 'suggested' shows the best guess; set the plot's status to ok, or draw two pairs in the layer 'pairs', and run again. In the layer 'pairs', set pair_status to ok, moved (after dragging a line's end to another tree) or rejected: what you locked is kept when you run again onto the same file. Unpaired trees of both sides stay in the layers 'field_trees' and 'measured_trees'. Units: metres, centimetres, degrees.</source>
      <translation>Convierte rumbo y distancia en coordenadas (norte geográfico, de cuadrícula o magnético; distancia horizontal o inclinada; hasta el centro o la cara del tronco), desplaza y gira cada parcela entera sobre los árboles medidos y empareja uno a uno. El DAP nunca se usa para emparejar, así los pares pueden juzgarlo. Donde dos colocaciones encajan casi igual de bien, como en hileras plantadas, la parcela queda en sus manos: la capa 'suggested' muestra la mejor conjetura; ponga el estado de la parcela en ok, o dibuje dos pares en la capa 'pairs', y ejecute otra vez. En la capa 'pairs', ponga pair_status en ok, moved (tras arrastrar el extremo de una línea a otro árbol) o rejected: lo que usted fijó se conserva al ejecutar otra vez sobre el mismo archivo. Los árboles sin pareja de ambos lados quedan en las capas 'field_trees' y 'measured_trees'. Unidades: metros, centímetros, grados.</translation>
    </message>
    <message>
      <source>measured trees: a tree layer, or CSV with tree_id, x, y, dbh_cm</source>
      <translation>árboles medidos: una capa de árboles, o un CSV con tree_id, x, y, dbh_cm</translation>
    </message>
    <message>
      <source>Field trees (table)</source>
      <translation>Árboles de campo (tabla)</translation>
    </message>
    <message>
      <source>field tally: plot_id, tree_id, azimuth_deg, distance_m (or easting, northing), dbh_cm</source>
      <translation>datos de campo: plot_id, tree_id, azimuth_deg, distance_m (o easting, northing), dbh_cm</translation>
    </message>
    <message>
      <source>plot centres: plot_id, easting, northing, epsg (or lon, lat), radius_m</source>
      <translation>centros de parcela: plot_id, easting, northing, epsg (o lon, lat), radius_m</translation>
    </message>
    <message>
      <source>North of the bearings</source>
      <translation>Norte de los rumbos</translation>
    </message>
    <message>
      <source>north that the bearings refer to (magnetic needs the date of the field work, or the declination)</source>
      <translation>norte al que se refieren los rumbos (el magnético necesita la fecha del trabajo de campo o la declinación)</translation>
    </message>
    <message>
      <source>pairs layer; pairs locked in an existing file are kept</source>
      <translation>capa de pares; los pares fijados en un archivo existente se conservan</translation>
    </message>
    <message>
      <source>Declination [degrees, east positive]</source>
      <translation>Declinación [grados, este positivo]</translation>
    </message>
    <message>
      <source>magnetic declination at the plot on the day of the field work; default: from the World Magnetic Model by --field-date, or the date column of a field table</source>
      <translation>declinación magnética en la parcela el día del trabajo de campo; por defecto, del World Magnetic Model según --field-date o la columna de fecha de una tabla de campo</translation>
    </message>
    <message>
      <source>Field date</source>
      <translation>Fecha de campo</translation>
    </message>
    <message>
      <source>day of the field work, year-month-day, for the declination</source>
      <translation>día del trabajo de campo, año-mes-día, para la declinación</translation>
    </message>
    <message>
      <source>Distances were taken</source>
      <translation>Distancias tomadas</translation>
    </message>
    <message>
      <source>distance along the level or along the ground (then the table needs slope_deg or slope_pct)</source>
      <translation>distancia en horizontal o a lo largo del terreno (entonces la tabla necesita slope_deg o slope_pct)</translation>
    </message>
    <message>
      <source>Distances reach to</source>
      <translation>Las distancias llegan hasta</translation>
    </message>
    <message>
      <source>distance to the middle of the stem, or to its near face (half the DBH is added)</source>
      <translation>distancia al centro del tronco o a su cara más cercana (se suma la mitad del DAP)</translation>
    </message>
    <message>
      <source>Distance unit</source>
      <translation>Unidad de la distancia</translation>
    </message>
    <message>
      <source>unit of a distance column that does not say it (auto: from a name like distance_m)</source>
      <translation>unidad de una columna de distancia que no la dice (auto: de un nombre como distance_m)</translation>
    </message>
    <message>
      <source>Centre error [m]</source>
      <translation>Error del centro [m]</translation>
    </message>
    <message>
      <source>standard error of the plot centres (0.05 for RTK, 4 under dense canopy); the search reaches three times as far</source>
      <translation>error estándar de los centros de parcela (0.05 con RTK, 4 bajo dosel denso); se busca hasta tres veces más lejos</translation>
    </message>
    <message>
      <source>Rotation [degrees]</source>
      <translation>Giro [grados]</translation>
    </message>
    <message>
      <source>the plot may be turned by up to this angle (compass, declination)</source>
      <translation>la parcela puede estar girada hasta este ángulo (brújula, declinación)</translation>
    </message>
    <message>
      <source>Trees DBH unit</source>
      <translation>Unidad del DAP de los árboles medidos</translation>
    </message>
    <message>
      <source>unit of a DBH column in a CSV of measured trees that does not say it (auto: from a name like dbh_cm)</source>
      <translation>unidad de una columna de DAP en un CSV de árboles medidos que no la dice (auto: de un nombre como dbh_cm)</translation>
    </message>
    <message>
      <source>CRS of measured trees in a CSV, or of a layer without one</source>
      <translation>SRC de los árboles medidos en un CSV, o de una capa sin SRC</translation>
    </message>
    <message>
      <source>pairs layer</source>
      <translation>capa de pares</translation>
    </message>
    <message>
      <source>field trees</source>
      <translation>árboles de campo</translation>
    </message>
    <message>
      <source>pairs made or confirmed</source>
      <translation>pares hechos o confirmados</translation>
    </message>
    <message>
      <source>measured trees that a person decided on</source>
      <translation>árboles medidos sobre los que decidió una persona</translation>
    </message>
    <message>
      <source>suggestions left to a hand check</source>
      <translation>propuestas pendientes de revisión manual</translation>
    </message>
    <message>
      <source>plots</source>
      <translation>parcelas</translation>
    </message>
    <message>
      <source>plots left to a hand check</source>
      <translation>parcelas pendientes de revisión manual</translation>
    </message>
    <message>
      <source>plots that fit best at the largest turn searched</source>
      <translation>parcelas que encajan mejor con el mayor giro buscado</translation>
    </message>
    <message>
      <source>Evaluate DBH accuracy</source>
      <translation>Evaluar la exactitud del DAP</translation>
    </message>
    <message>
      <source>Accuracy tables and charts of measured DBH against field DBH.</source>
      <translation>Tablas y gráficos del DAP medido frente al de campo.</translation>
    </message>
    <message>
      <source>From the pairs layer of match-plots (pair_status auto, ok and moved count; rejected never): number of trees, success rate (trees with a DBH of all field trees), RMSE, RRMSE (of the mean field DBH), MAE, mean error (measured minus field), share of trees inside the stated 90 % interval and false trees, per plot and pooled, with bootstrap intervals by plot. Writes metrics.json, per_plot.csv, trees.csv, table.tex, charts (SVG and PNG) and evaluation.html. Plots left to a hand check do not count and are named. With --plots: several plots in one table, with mean, standard deviation and range over plots. With its columns lidar and splats: cylinder, circle and weighted circle on both, p chosen on held-out stems, densities, trend over DBH, ablation, and (simulated plots) segmentation scores and true labels. With workspace_in: how many photos show breast height, and runtime. Units: centimetres and per cent; rates in metrics.json are 0 to 1.</source>
      <translation>De la capa de pares de match-plots (cuentan pair_status auto, ok y moved; rejected nunca): número de árboles, tasa de éxito (árboles con DAP de todos los de campo), RMSE, RRMSE (del DAP medio de campo), MAE, error medio (medido menos campo), parte de los árboles dentro del intervalo del 90 % indicado y árboles falsos, por parcela y en conjunto, con intervalos bootstrap por parcela. Escribe metrics.json, per_plot.csv, trees.csv, table.tex, gráficos (SVG y PNG) y evaluation.html. Las parcelas pendientes de revisión manual no cuentan y se nombran. Con --plots: varias parcelas en una tabla, con media, desviación estándar y rango entre parcelas. Con sus columnas lidar y splats: cilindro, círculo y círculo ponderado en ambos, p elegido con troncos reservados, densidades, tendencia con el DAP, ablación y (parcelas simuladas) calidad de la segmentación y etiquetas verdaderas. Con workspace_in: cuántas fotos muestran la altura del pecho, y tiempos. Unidades: centímetros y por ciento; las tasas en metrics.json van de 0 a 1.</translation>
    </message>
    <message>
      <source>CSV with a row a plot and the columns plot_id, trees and truth (or pairs), and where there are any lidar, splats (surface.laz or stems.laz), dtm, workspace_in (of photos-to-dbh); paths count from the CSV's folder</source>
      <translation>CSV con una fila por parcela y las columnas plot_id, trees y truth (o pairs), y donde los haya lidar, splats (surface.laz o stems.laz), dtm, workspace_in (de photos-to-dbh); las rutas cuentan desde la carpeta del CSV</translation>
    </message>
    <message>
      <source>pairs layer of match-plots, checked by you</source>
      <translation>capa de pares de match-plots, revisada por usted</translation>
    </message>
    <message>
      <source>instead of pairs: a tree layer of a simulated plot</source>
      <translation>en vez de los pares: una capa de árboles de una parcela simulada</translation>
    </message>
    <message>
      <source>folder for metrics.json, tables, charts and evaluation.html</source>
      <translation>carpeta para metrics.json, tablas, gráficos y evaluation.html</translation>
    </message>
    <message>
      <source>smallest DBH that the field crew tallied; thinner measured trees are not counted as false</source>
      <translation>menor DAP que registró el equipo de campo; los árboles medidos más finos no cuentan como falsos</translation>
    </message>
    <message>
      <source>Truth</source>
      <translation>Verdad</translation>
    </message>
    <message>
      <source>with --trees: the plot's truth/trees.csv</source>
      <translation>con --trees: el truth/trees.csv de la parcela</translation>
    </message>
    <message>
      <source>Pairs of another method</source>
      <translation>Parejas de otro método</translation>
    </message>
    <message>
      <source>pairs layer of another method for the same field trees: both are also scored on the trees both measured</source>
      <translation>capa de pares de otro método para los mismos árboles de campo: ambos se puntúan también en los árboles medidos por los dos</translation>
    </message>
    <message>
      <source>folder</source>
      <translation>carpeta</translation>
    </message>
    <message>
      <source>page with the paper's tables and figures</source>
      <translation>página con las tablas y figuras del artículo</translation>
    </message>
    <message>
      <source>metrics.json</source>
      <translation>metrics.json</translation>
    </message>
    <message>
      <source>trees measured and compared</source>
      <translation>árboles medidos y comparados</translation>
    </message>
    <message>
      <source>measured of field trees, 0 to 1</source>
      <translation>medidos de los árboles de campo, de 0 a 1</translation>
    </message>
    <message>
      <source>RMSE, cm</source>
      <translation>RMSE, cm</translation>
    </message>
    <message>
      <source>RMSE, per cent of the mean field DBH</source>
      <translation>RMSE, por ciento del DAP medio de campo</translation>
    </message>
    <message>
      <source>mean absolute error, cm</source>
      <translation>error absoluto medio, cm</translation>
    </message>
    <message>
      <source>mean error, cm</source>
      <translation>error medio, cm</translation>
    </message>
    <message>
      <source>measured trees that are no field tree</source>
      <translation>árboles medidos que no son ningún árbol de campo</translation>
    </message>
    <message>
      <source>share inside the stated 90 % interval, 0 to 1</source>
      <translation>parte dentro del intervalo del 90 % indicado, de 0 a 1</translation>
    </message>
    <message>
      <source>Choose trees to tape</source>
      <translation>Elegir árboles para medir con cinta</translation>
    </message>
    <message>
      <source>Draws the trees to tape with known chances, with a map and form to print and waypoints for the phone.</source>
      <translation>Sortea con probabilidades conocidas los árboles que medir con cinta; con mapa y formulario para imprimir y puntos para el teléfono.</translation>
    </message>
    <message>
      <source>Draws trees of a tree layer so that the tapes can correct its totals (tape-check, stand-table): stratified by flag and DBH class, simple random in each. Stems without a DBH can be drawn too; dead trees are not. Writes tapes.gpkg and tapes.csv to fill in (taped_cm, or girth_cm; state none, dead or not reached; a row without tree_id is a tree that the map lacks), tapes.gpx for the phone, and tape_form.pdf and tape_form.html to print: per plot a map, the trees in the order of a walk, and room for trees that the map lacks. The form shows the measured DBH rounded to 5 cm, so that nobody reads the tape towards it. A folder whose table is filled in already is not written over.</source>
      <translation>Sortea árboles de una capa de árboles para que las cintas puedan corregir sus totales (tape-check, stand-table): estratificado por marca y clase de DAP, aleatorio simple en cada una. También pueden salir fustes sin DAP; los árboles muertos no. Escribe tapes.gpkg y tapes.csv para rellenar (taped_cm o girth_cm; state none, dead o not reached; una fila sin tree_id es un árbol que falta en el mapa), tapes.gpx para el teléfono, y tape_form.pdf y tape_form.html para imprimir: por parcela un mapa, los árboles en el orden del recorrido y sitio para árboles que faltan en el mapa. El formulario muestra el DAP medido redondeado a 5 cm, para que nadie lea la cinta hacia él. No se sobrescribe una carpeta con la tabla ya rellenada.</translation>
    </message>
    <message>
      <source>measured trees: the tree layer</source>
      <translation>árboles medidos: la capa de árboles</translation>
    </message>
    <message>
      <source>plots, as for stand-table: only trees in them are drawn, and the form gives bearing and distance from the plot's centre; without: the trees that have a plot_id, or all</source>
      <translation>parcelas, como para stand-table: solo se sortean árboles en ellas, y el formulario da rumbo y distancia desde el centro; sin ellas: los árboles con plot_id, o todos</translation>
    </message>
    <message>
      <source>trees to tape</source>
      <translation>árboles que medir con cinta</translation>
    </message>
    <message>
      <source>folder for the tape table, the form and the phone's waypoints</source>
      <translation>carpeta para la tabla, el formulario y los puntos para el teléfono</translation>
    </message>
    <message>
      <source>Seed</source>
      <translation>Semilla</translation>
    </message>
    <message>
      <source>another number draws other trees; the same draws the same again</source>
      <translation>otro número sortea otros árboles; el mismo, los mismos otra vez</translation>
    </message>
    <message>
      <source>CRS of trees in a CSV, or of a layer without one</source>
      <translation>SRC de los árboles en un CSV, o de una capa sin SRC</translation>
    </message>
    <message>
      <source>the drawn trees, to fill in</source>
      <translation>los árboles sorteados, para rellenar</translation>
    </message>
    <message>
      <source>the same as CSV</source>
      <translation>lo mismo como CSV</translation>
    </message>
    <message>
      <source>the form to print (PDF)</source>
      <translation>el formulario para imprimir (PDF)</translation>
    </message>
    <message>
      <source>the form as a page</source>
      <translation>el formulario como página</translation>
    </message>
    <message>
      <source>waypoints</source>
      <translation>puntos de ruta</translation>
    </message>
    <message>
      <source>trees drawn</source>
      <translation>árboles sorteados</translation>
    </message>
    <message>
      <source>trees they were drawn from</source>
      <translation>árboles entre los que se sorteó</translation>
    </message>
    <message>
      <source>Check diameters against tapes</source>
      <translation>Comprobar diámetros con cinta</translation>
    </message>
    <message>
      <source>What taped trees say of the measured ones: bias, intervals, flags, outliers, corrected totals.</source>
      <translation>Qué dicen los árboles medidos con cinta: sesgo, intervalos, marcas, atípicos, totales corregidos.</translation>
    </message>
    <message>
      <source>Reads the filled-in table of tape-sample. Bias (measured minus taped) and RMSE of all trees of the layer, with intervals that follow from the draw; whether the layer's 90 % intervals hold; whether trees marked ok are better than those marked check; outliers by name (and whether two numbers were exchanged); number and basal area of the trees corrected by the difference estimator of double sampling, with standard errors and how many more tapes would halve them. Units that the values contradict (inches, girths) are refused. Writes tape_check.html, .pdf, .csv, .gpkg and .json. stand-table --taped takes the same table.</source>
      <translation>Lee la tabla rellenada de tape-sample. Sesgo (medido menos cinta) y RMSE de todos los árboles de la capa, con intervalos que se siguen del sorteo; si los intervalos del 90 % de la capa se cumplen; si los árboles ok son mejores que los check; atípicos por número (y si se intercambiaron dos números); número y área basal de los árboles corregidos con el estimador de diferencia del muestreo doble, con errores estándar y cuántas cintas más los reducirían a la mitad. Se rechazan unidades que los valores contradicen (pulgadas, circunferencias). Escribe tape_check.html, .pdf, .csv, .gpkg y .json. stand-table --taped toma la misma tabla.</translation>
    </message>
    <message>
      <source>the tree layer that the taped trees were drawn from</source>
      <translation>la capa de árboles de la que se sortearon</translation>
    </message>
    <message>
      <source>Taped trees (table)</source>
      <translation>Árboles con cinta (tabla)</translation>
    </message>
    <message>
      <source>the tape table of tape-sample, filled in: tapes.gpkg or tapes.csv</source>
      <translation>la tabla de tape-sample, rellenada: tapes.gpkg o tapes.csv</translation>
    </message>
    <message>
      <source>the plots that were given to tape-sample</source>
      <translation>las parcelas que se dieron a tape-sample</translation>
    </message>
    <message>
      <source>folder for the page and the tables</source>
      <translation>carpeta para la página y las tablas</translation>
    </message>
    <message>
      <source>the same as PDF</source>
      <translation>lo mismo en PDF</translation>
    </message>
    <message>
      <source>the taped trees with their errors</source>
      <translation>los árboles medidos con cinta con sus errores</translation>
    </message>
    <message>
      <source>trees both measured and taped</source>
      <translation>árboles con medición y cinta</translation>
    </message>
    <message>
      <source>mean error, measured minus taped, cm</source>
      <translation>error medio, medido menos cinta, cm</translation>
    </message>
    <message>
      <source>its interval from, cm</source>
      <translation>su intervalo desde, cm</translation>
    </message>
    <message>
      <source>its interval to, cm</source>
      <translation>su intervalo hasta, cm</translation>
    </message>
    <message>
      <source>trees with an interval</source>
      <translation>árboles con intervalo</translation>
    </message>
    <message>
      <source>of these, with the tape inside</source>
      <translation>de ellos, con la cinta dentro</translation>
    </message>
    <message>
      <source>trees to look at again</source>
      <translation>árboles que mirar otra vez</translation>
    </message>
    <message>
      <source>Test on your own taped plot</source>
      <translation>Probar en su propia parcela medida con cinta</translation>
    </message>
    <message>
      <source>Seals measured diameters, has trees taped without knowing them, and judges them by the tapes.</source>
      <translation>Sella los diámetros medidos, hace medir árboles con cinta sin conocerlos y los juzga por las cintas.</translation>
    </message>
    <message>
      <source>Two steps in one folder. First --trees and --limit-cm: seals the layer's rows, the run's settings (where its run.json lies beside the layer), version and limit by SHA-256 in trial.json, and writes the files for the field as tape-sample does, without any diameter: all trees, or --n drawn at random. second_taped_cm takes a second tape of some trees. Then --taped: what was changed since is named and refused. Otherwise result/evaluation.html says RMSE, bias with its 90 % interval, whether measured and taped diameters are equivalent within the limit (two one-sided tests), how many 90 % intervals hold the tape, and how well tapes repeat; the figures are those of evaluate. bundle.json has the numbers without places, names and dates: send it in if you like.</source>
      <translation>Dos pasos en una carpeta. Primero --trees y --limit-cm: sella con SHA-256 en trial.json las filas de la capa, los ajustes de la ejecución (donde su run.json está junto a la capa), la versión y el límite, y escribe los archivos para el campo como tape-sample, pero sin ningún diámetro: todos los árboles, o --n sorteados al azar. second_taped_cm admite una segunda cinta de algunos árboles. Después --taped: lo que se cambió desde entonces se nombra y se rechaza. Si no, result/evaluation.html dice RMSE, sesgo con su intervalo del 90 %, si los diámetros medidos y los de cinta son equivalentes dentro del límite (dos pruebas unilaterales), cuántos intervalos del 90 % contienen la cinta y cuánto se repiten las cintas; las cifras son las de evaluate. bundle.json tiene los números sin lugares, nombres ni fechas: envíelo si quiere.</translation>
    </message>
    <message>
      <source>first step: the tree layer to test; the trees.gpkg of a workspace seals the run's settings too. Second step: only where the layer was moved since</source>
      <translation>primer paso: la capa de árboles que se prueba; el trees.gpkg de una carpeta de trabajo sella también los ajustes de la ejecución. Segundo paso: solo si la capa se movió desde entonces</translation>
    </message>
    <message>
      <source>Limit [cm]</source>
      <translation>Límite [cm]</translation>
    </message>
    <message>
      <source>first step: the mean error, either way, that you would still accept</source>
      <translation>primer paso: el error medio, en ambos sentidos, que aún aceptaría</translation>
    </message>
    <message>
      <source>trees to tape, drawn at random; without: all</source>
      <translation>árboles que medir con cinta, sorteados al azar; sin indicar: todos</translation>
    </message>
    <message>
      <source>plots, as for tape-sample: only trees in them are drawn</source>
      <translation>parcelas, como en tape-sample: solo se sortean árboles dentro de ellas</translation>
    </message>
    <message>
      <source>second step: the table of the first one, filled in: tapes.gpkg or tapes.csv</source>
      <translation>segundo paso: la tabla del primero, rellenada: tapes.gpkg o tapes.csv</translation>
    </message>
    <message>
      <source>folder of the trial, the same for both steps</source>
      <translation>carpeta de la prueba, la misma para los dos pasos</translation>
    </message>
    <message>
      <source>the page to open: the form, then the result</source>
      <translation>la página que abrir: el formulario, luego el resultado</translation>
    </message>
    <message>
      <source>first step: the drawn trees, to fill in</source>
      <translation>primer paso: los árboles sorteados, para rellenar</translation>
    </message>
    <message>
      <source>second step: the numbers, without places and names</source>
      <translation>segundo paso: los números, sin lugares ni nombres</translation>
    </message>
    <message>
      <source>SHA-256 of all that is sealed</source>
      <translation>SHA-256 de todo lo sellado</translation>
    </message>
    <message>
      <source>trees drawn, then trees both measured and taped</source>
      <translation>árboles sorteados, luego árboles medidos y con cinta</translation>
    </message>
    <message>
      <source>equivalent, not equivalent or undecided</source>
      <translation>equivalent (equivalente), not equivalent (no equivalente) o undecided (sin decidir)</translation>
    </message>
    <message>
      <source>Stand table and report</source>
      <translation>Tabla de rodal e informe</translation>
    </message>
    <message>
      <source>4 Report</source>
      <translation>4 Informar</translation>
    </message>
    <message>
      <source>Stand and stock tables per hectare with their errors, and a report for the client.</source>
      <translation>Tablas de rodal y existencias por hectárea con sus errores, y un informe para el cliente.</translation>
    </message>
    <message>
      <source>Expands the trees of fixed-area plots (round, rectangular or any polygon) to the hectare: trees, basal area, quadratic mean diameter, Lorey's and dominant height, volume and biomass by species and DBH class, plot means with standard errors and t intervals. Basal area and volume are freed of what the DBHs' own errors add to them, and the amount is shown. Stems without a DBH are counted and either imputed or left out; both are reported. With --taped (tape-sample) trees, basal area, volume and biomass are corrected by taped trees, and the interval is that of the tapes and the plots. Plots over the stand's edge are flagged and weighted. Volume and biomass come from a table of equations with source and range (loblolly and other pines first); give your own with --equations. From one plot no error for the stand can be given, and none is. Writes report.html, report.pdf, stand_table.xlsx, CSV files, stand.gpkg, shapefiles and FVS_Data.db (US units, for the Forest Vegetation Simulator), all with the same numbers. Result figures are metric.</source>
      <translation>Expande a la hectárea los árboles de parcelas de superficie fija (redondas, rectangulares o cualquier polígono): número de pies, área basal, diámetro medio cuadrático, alturas de Lorey y dominante, volumen y biomasa por especie y clase diamétrica, medias de parcela con errores estándar e intervalos t. El área basal y el volumen se libran de lo que les añaden los propios errores del DAP, y se muestra cuánto es. Los troncos sin DAP se cuentan y se imputan o se omiten; se informa de ambas opciones. Con --taped (tape-sample) los árboles medidos con cinta corrigen número de pies, área basal, volumen y biomasa, y el intervalo es el de las cintas y las parcelas. Las parcelas que pasan del límite del rodal se señalan y se ponderan. Volumen y biomasa salen de una tabla de ecuaciones con fuente y rango (primero pino taeda y otros pinos); dé las suyas con --equations. De una sola parcela no se puede dar un error para el rodal, y no se da. Escribe report.html, report.pdf, stand_table.xlsx, archivos CSV, stand.gpkg, shapefiles y FVS_Data.db (unidades de EE. UU., para el Forest Vegetation Simulator), todos con las mismas cifras. Los valores de resultado son métricos.</translation>
    </message>
    <message>
      <source>plots: centre and radius_m (or width_m, length_m), or a polygon layer; without: the whole boundary is one census</source>
      <translation>parcelas: centro y radius_m (o width_m, length_m), o una capa de polígonos; si falta, todo el límite es un censo</translation>
    </message>
    <message>
      <source>Species</source>
      <translation>Especie</translation>
    </message>
    <message>
      <source>species of trees that have none: PLANTS symbol, FIA number or name (PITA, 131, Pinus taeda)</source>
      <translation>especie de los árboles que no la tienen: símbolo PLANTS, número FIA o nombre (PITA, 131, Pinus taeda)</translation>
    </message>
    <message>
      <source>pairs layer of match-plots: species and status of the measured trees</source>
      <translation>capa de pares de match-plots: especie y estado de los árboles medidos</translation>
    </message>
    <message>
      <source>field tally: heights of the paired trees; without --trees it is the tree list itself</source>
      <translation>datos de campo: alturas de los árboles emparejados; sin --trees son ellos mismos la lista de árboles</translation>
    </message>
    <message>
      <source>Stand boundary</source>
      <translation>Límite del rodal</translation>
    </message>
    <message>
      <source>the stand's outline: finds plots that reach over its edge</source>
      <translation>el contorno del rodal: detecta las parcelas que pasan de su borde</translation>
    </message>
    <message>
      <source>the tape table of tape-sample, filled in: corrects trees, basal area, volume and biomass</source>
      <translation>la tabla de tape-sample, rellenada: corrige árboles, área basal, volumen y biomasa</translation>
    </message>
    <message>
      <source>Units</source>
      <translation>Unidades</translation>
    </message>
    <message>
      <source>units of the report</source>
      <translation>unidades del informe</translation>
    </message>
    <message>
      <source>smallest DBH that counts</source>
      <translation>menor DAP que cuenta</translation>
    </message>
    <message>
      <source>folder for the report and the tables</source>
      <translation>carpeta del informe y las tablas</translation>
    </message>
    <message>
      <source>Class width [cm, or inches in US units]</source>
      <translation>Amplitud de clase [cm, o pulgadas en unidades de EE. UU.]</translation>
    </message>
    <message>
      <source>width of a DBH class (5 cm or 2 inches where not given)</source>
      <translation>amplitud de una clase diamétrica (5 cm o 2 pulgadas si no se da)</translation>
    </message>
    <message>
      <source>Origin</source>
      <translation>Origen</translation>
    </message>
    <message>
      <source>how the stand came about</source>
      <translation>cómo se originó el rodal</translation>
    </message>
    <message>
      <source>Stems without a DBH</source>
      <translation>Troncos sin DAP</translation>
    </message>
    <message>
      <source>stems seen but without a DBH: count each, by its chance of being a tree, as the mean of its plot's measured trees, or leave them out (both results are reported)</source>
      <translation>troncos vistos pero sin DAP: contar cada uno, según la probabilidad de que sea un árbol, como la media de los árboles medidos de su parcela, u omitirlos (se dan ambos resultados)</translation>
    </message>
    <message>
      <source>heights of trees that have none: from a curve fitted to the measured ones, none at all, or from a published regional curve</source>
      <translation>alturas de los árboles que no la tienen: de una curva ajustada a las medidas, ninguna, o de una curva regional publicada</translation>
    </message>
    <message>
      <source>Equations</source>
      <translation>Ecuaciones</translation>
    </message>
    <message>
      <source>your own equations, tried before the built-in ones</source>
      <translation>sus propias ecuaciones, probadas antes que las incorporadas</translation>
    </message>
    <message>
      <source>Top [cm]</source>
      <translation>Extremo delgado [cm]</translation>
    </message>
    <message>
      <source>top diameter of the stem volumes that measured stem curves give (sections of the tree layer)</source>
      <translation>diámetro en punta delgada de los volúmenes de fuste que dan las curvas medidas (sections de la capa de árboles)</translation>
    </message>
    <message>
      <source>Edge</source>
      <translation>Borde</translation>
    </message>
    <message>
      <source>trees and plots at the stand's edge: zone (a tree weighs by the part of the plot-sized zone around it that is inside), walkthrough (some trees count twice), area (only the plot's part inside) or none (only flagged)</source>
      <translation>árboles y parcelas en el borde del rodal: zone (un árbol pesa según la parte interior de la zona del tamaño de la parcela a su alrededor), walkthrough (algunos árboles cuentan dos veces), area (solo la parte interior de la parcela) o none (solo se señalan)</translation>
    </message>
    <message>
      <source>Plot size</source>
      <translation>Tamaño de parcela</translation>
    </message>
    <message>
      <source>plot sizes are horizontal, or were laid out along the slope (then slope_pct or slope_deg is needed)</source>
      <translation>los tamaños de parcela son horizontales o se replantearon a lo largo de la pendiente (entonces hace falta slope_pct o slope_deg)</translation>
    </message>
    <message>
      <source>DBH standard error [cm]</source>
      <translation>Error estándar del DAP [cm]</translation>
    </message>
    <message>
      <source>standard error of DBH for trees that have none</source>
      <translation>error estándar del DAP de los árboles que no lo tienen</translation>
    </message>
    <message>
      <source>Common standard error [cm]</source>
      <translation>Error estándar común [cm]</translation>
    </message>
    <message>
      <source>standard error of a bias that all DBHs share (not given: 0.2 for measured trees, 0 for a field tally)</source>
      <translation>error estándar de un sesgo común a todos los DAP (si no se da: 0.2 para árboles medidos, 0 para datos de campo)</translation>
    </message>
    <message>
      <source>Confidence [%]</source>
      <translation>Confianza [%]</translation>
    </message>
    <message>
      <source>confidence of the intervals</source>
      <translation>confianza de los intervalos</translation>
    </message>
    <message>
      <source>breast height of the height curve, for a field tally (a tree layer says its own)</source>
      <translation>altura del pecho de la curva de alturas, para datos de campo (una capa de árboles dice la suya)</translation>
    </message>
    <message>
      <source>Stand ID</source>
      <translation>Identificador del rodal</translation>
    </message>
    <message>
      <source>name of the stand, in every file</source>
      <translation>nombre del rodal, en cada archivo</translation>
    </message>
    <message>
      <source>plots and trees as map layers</source>
      <translation>parcelas y árboles como capas del mapa</translation>
    </message>
    <message>
      <source>trees measured in the plots</source>
      <translation>árboles medidos en las parcelas</translation>
    </message>
    <message>
      <source>stems seen without a DBH</source>
      <translation>troncos vistos sin DAP</translation>
    </message>
    <message>
      <source>trees that a person decided on</source>
      <translation>árboles sobre los que decidió una persona</translation>
    </message>
    <message>
      <source>trees per hectare</source>
      <translation>árboles por hectárea</translation>
    </message>
    <message>
      <source>basal area, m²/ha</source>
      <translation>área basal, m²/ha</translation>
    </message>
    <message>
      <source>its standard error, m²/ha</source>
      <translation>su error estándar, m²/ha</translation>
    </message>
    <message>
      <source>quadratic mean diameter, cm</source>
      <translation>diámetro medio cuadrático, cm</translation>
    </message>
    <message>
      <source>Lorey's mean height, m</source>
      <translation>altura media de Lorey, m</translation>
    </message>
    <message>
      <source>dominant height, m</source>
      <translation>altura dominante, m</translation>
    </message>
    <message>
      <source>volume, m³/ha</source>
      <translation>volumen, m³/ha</translation>
    </message>
    <message>
      <source>above-ground biomass, t/ha</source>
      <translation>biomasa aérea, t/ha</translation>
    </message>
    <message>
      <source>Compare two dates</source>
      <translation>Comparar dos fechas</translation>
    </message>
    <message>
      <source>Growth, ingrowth and mortality between two tree layers of the same ground, per tree and per hectare.</source>
      <translation>Crecimiento, incorporación y mortalidad entre dos capas de árboles del mismo terreno, por árbol y por hectárea.</translation>
    </message>
    <message>
      <source>Pairs the trees of both dates by position, plot by plot, as match-plots pairs field plots (the maps may be shifted and turned against each other; a plot whose placing is not sure is left out and named). Per tree: growth of DBH with its interval. Per hectare (with plots): growth of survivors, ingrowth, mortality and net change of basal area and of the number of trees, with errors from the spread of the plots and from what all trees of a date share (bias of the camera, scale of the block), which does not average out. A new tree that is too thick to be new was missed at the first date; the share of such trees says how many of those that are not found again are dead. Reviewed trees count as reviewed. Writes change.gpkg, change.csv, change.html, change.pdf and change.json.</source>
      <translation>Empareja por posición los árboles de ambas fechas, parcela por parcela, como match-plots con las parcelas de campo (los mapas pueden estar desplazados y girados entre sí; una parcela de colocación insegura se deja fuera y se nombra). Por árbol: crecimiento del DAP con su intervalo. Por hectárea (con parcelas): crecimiento de los supervivientes, incorporación, mortalidad y cambio neto del área basal y del número de pies, con errores de la dispersión entre parcelas y de lo que comparten todos los árboles de una fecha (sesgo de la cámara, escala del bloque), que no se promedia. Un árbol nuevo demasiado grueso para serlo se omitió en la primera fecha; la proporción de tales árboles dice cuántos de los no encontrados están muertos. Los árboles revisados cuentan como se revisaron. Escribe change.gpkg, change.csv, change.html, change.pdf y change.json.</translation>
    </message>
    <message>
      <source>Before</source>
      <translation>Antes</translation>
    </message>
    <message>
      <source>tree layer of the first date</source>
      <translation>capa de árboles de la primera fecha</translation>
    </message>
    <message>
      <source>After</source>
      <translation>Después</translation>
    </message>
    <message>
      <source>tree layer of the second date</source>
      <translation>capa de árboles de la segunda fecha</translation>
    </message>
    <message>
      <source>Years</source>
      <translation>Años</translation>
    </message>
    <message>
      <source>years (seasons of growth) between the dates; needed where the layers do not say when they were flown</source>
      <translation>años (períodos vegetativos) entre las fechas; necesario donde las capas no dicen cuándo se volaron</translation>
    </message>
    <message>
      <source>plots, as for stand-table; without: all trees together, and nothing per hectare</source>
      <translation>parcelas, como para stand-table; sin ellas: todos los árboles juntos y nada por hectárea</translation>
    </message>
    <message>
      <source>folder for the page, the layer and the tables</source>
      <translation>carpeta para la página, la capa y las tablas</translation>
    </message>
    <message>
      <source>Max yearly growth [cm]</source>
      <translation>Crecimiento anual máximo [cm]</translation>
    </message>
    <message>
      <source>what no tree grows more in a year: a new one that is thicker than this allows was missed at the first date</source>
      <translation>lo que ningún árbol supera en un año: uno nuevo más grueso de lo que esto permite se omitió en la primera fecha</translation>
    </message>
    <message>
      <source>standard error of a bias that all DBHs of one date share</source>
      <translation>error estándar de un sesgo que comparten todos los DAP de una fecha</translation>
    </message>
    <message>
      <source>Block before [%]</source>
      <translation>Bloque antes [%]</translation>
    </message>
    <message>
      <source>relative standard error of lengths in the first date's block (scale_sd in the workspace's run.json, times 100)</source>
      <translation>error estándar relativo de las longitudes en el bloque de la primera fecha (scale_sd en run.json del espacio de trabajo, por 100)</translation>
    </message>
    <message>
      <source>Block after [%]</source>
      <translation>Bloque después [%]</translation>
    </message>
    <message>
      <source>the same of the second date's block</source>
      <translation>lo mismo del bloque de la segunda fecha</translation>
    </message>
    <message>
      <source>how far the two maps may be shifted against each other, standard error (0.05 with RTK or PPK, 3 without)</source>
      <translation>cuánto pueden estar desplazados los dos mapas entre sí, error estándar (0,05 con RTK o PPK, 3 sin)</translation>
    </message>
    <message>
      <source>every tree with what became of it</source>
      <translation>cada árbol con lo que fue de él</translation>
    </message>
    <message>
      <source>trees measured at both dates</source>
      <translation>árboles medidos en ambas fechas</translation>
    </message>
    <message>
      <source>trees that grew into the count</source>
      <translation>árboles incorporados</translation>
    </message>
    <message>
      <source>trees not found again, or dead</source>
      <translation>árboles no encontrados de nuevo, o muertos</translation>
    </message>
    <message>
      <source>trees whose partner is not sure</source>
      <translation>árboles sin pareja segura</translation>
    </message>
    <message>
      <source>mean growth of DBH of the survivors, cm a year</source>
      <translation>crecimiento medio del DAP de los supervivientes, cm al año</translation>
    </message>
    <message>
      <source>net change of basal area, m²/ha</source>
      <translation>cambio neto del área basal, m²/ha</translation>
    </message>
    <message>
      <source>Benchmark speed and accuracy</source>
      <translation>Comparar velocidad y exactitud</translation>
    </message>
    <message>
      <source>Chart seconds against DBH error for every preset and method; or test where they fail.</source>
      <translation>Gráfico de segundos frente al error del DAP para cada preajuste y método; o probar dónde fallan.</translation>
    </message>
    <message>
      <source>Runs each configuration (presets, number of photos, photo size, features, LiDAR methods) on simulated plots with known truth and charts seconds, memory, RMSE and success rate, with the Pareto front and a recommended configuration for each preset. With --suite stability: one trouble at a time (few photos, wind, lean, pose noise, clutter, ...) at rising severity: errors, refusals, interval coverage, and every accepted tree that is more than 2 cm or three stated errors off. With --suite cost: how seconds and memory grow. Writes SVG, PNG, CSV, JSON, Markdown and a page without outside files. Compare seconds only within one run on an idle machine.</source>
      <translation>Ejecuta cada configuración (preajustes, número de fotos, tamaño de foto, puntos característicos, métodos LiDAR) en parcelas simuladas de verdad conocida y representa segundos, memoria, RMSE y tasa de éxito, con el frente de Pareto y una configuración recomendada para cada preajuste. Con --suite stability: un problema cada vez (pocas fotos, viento, inclinación, ruido de poses, maleza, ...) con gravedad creciente: errores, rechazos, acierto de los intervalos y cada árbol aceptado que yerra más de 2 cm o de tres errores indicados. Con --suite cost: cómo crecen segundos y memoria. Escribe SVG, PNG, CSV, JSON, Markdown y una página sin archivos externos. Compare segundos solo dentro de una ejecución en un equipo sin otra carga.</translation>
    </message>
    <message>
      <source>simulated plot, or a folder of them, to measure on; without it plots are simulated</source>
      <translation>parcela simulada, o una carpeta de ellas, en las que medir; si falta, se simulan</translation>
    </message>
    <message>
      <source>folder for charts and tables; finished runs are kept there, so that a stopped benchmark resumes</source>
      <translation>carpeta para gráficos y tablas; ahí se conservan las ejecuciones terminadas, así una comparación interrumpida continúa</translation>
    </message>
    <message>
      <source>Suite</source>
      <translation>Serie</translation>
    </message>
    <message>
      <source>chart: seconds against error; stability: one factor at a time from harmless to hopeless; cost: seconds and memory of each stage against photos, megapixels, stems and points, fitted</source>
      <translation>chart: segundos frente a error; stability: un factor cada vez, de inofensivo a imposible; cost: segundos y memoria de cada etapa frente a fotos, megapíxeles, troncos y puntos, ajustados</translation>
    </message>
    <message>
      <source>Quick</source>
      <translation>Rápido</translation>
    </message>
    <message>
      <source>one small plot and a dozen configurations: about 10 minutes on two idle cores</source>
      <translation>una parcela pequeña y una docena de configuraciones: unos 10 minutos en dos núcleos libres</translation>
    </message>
    <message>
      <source>the chart (SVG)</source>
      <translation>el gráfico (SVG)</translation>
    </message>
    <message>
      <source>runs of the chart</source>
      <translation>ejecuciones del gráfico</translation>
    </message>
    <message>
      <source>configuration for each preset</source>
      <translation>configuración para cada preajuste</translation>
    </message>
    <message>
      <source>what there was no time for</source>
      <translation>para lo que no hubo tiempo</translation>
    </message>
    <message>
      <source>cases of the stability suite</source>
      <translation>casos de la serie de estabilidad</translation>
    </message>
    <message>
      <source>cases that it has</source>
      <translation>casos que contiene</translation>
    </message>
    <message>
      <source>trees accepted by the photo method</source>
      <translation>árboles aceptados por el método de fotos</translation>
    </message>
    <message>
      <source>of them wrong: 2 cm or three stated errors off</source>
      <translation>de ellos erróneos: con 2 cm o tres errores indicados de diferencia</translation>
    </message>
    <message>
      <source>of them inside the stated 90 % interval, 0 to 1</source>
      <translation>de ellos, dentro del intervalo del 90 % indicado, de 0 a 1</translation>
    </message>
    <message>
      <source>at most 2 % of the accepted trees are wrong: 2 cm or three stated errors off</source>
      <translation>como mucho el 2 % de los árboles aceptados es erróneo: 2 cm o tres errores indicados de diferencia</translation>
    </message>
    <message>
      <source>the paper's own case on this machine, minutes</source>
      <translation>el caso del artículo en este equipo, minutos</translation>
    </message>
    <message>
      <source>seconds it took</source>
      <translation>segundos empleados</translation>
    </message>
    <message>
      <source>Simulate a plot</source>
      <translation>Simular una parcela</translation>
    </message>
    <message>
      <source>Make a synthetic forest plot: drone photos, PPK files, LiDAR, field table and truth.</source>
      <translation>Crear una parcela sintética: fotos de dron, archivos PPK, LiDAR, tabla de campo y verdad.</translation>
    </message>
    <message>
      <source>Grows a pine stand on rough ground and photographs it by ray casting in two oblique flights, with occluding crowns, shrubs and cast shadows, lens distortion and sensor noise. Writes images/ (EXIF, GPS, DJI XMP), the MRK and .pos files, dtm.tif, plots.csv, field_trees.csv, lidar/ and truth/ (for scoring only). Coordinates are EPSG:6344, heights ellipsoidal metres, DBH centimetres. Use it to try the chain, to test, or to see what a flight plan would measure. Real photos are harder than the defaults: wind, rolling shutter, motion blur, a real lens and sensor, grid flights over several plots and odd stands are options of treedgs simulate-plot, which its own help lists.</source>
      <translation>Hace crecer un pinar sobre terreno irregular y lo fotografía por trazado de rayos en dos vuelos oblicuos, con copas que tapan, arbustos y sombras, distorsión de la lente y ruido del sensor. Escribe images/ (EXIF, GPS, XMP de DJI), los archivos MRK y .pos, dtm.tif, plots.csv, field_trees.csv, lidar/ y truth/ (solo para puntuar). Las coordenadas son EPSG:6344, las alturas metros elipsoidales, los DAP centímetros. Sirve para probar la cadena, para los tests o para ver qué mediría un plan de vuelo. Las fotos reales son más difíciles que los valores predeterminados: viento, obturador rodante, desenfoque de movimiento, una lente y un sensor reales, vuelos en cuadrícula sobre varias parcelas y rodales peculiares son opciones de la línea de órdenes (treedgs simulate-plot; véase su ayuda).</translation>
    </message>
    <message>
      <source>folder for the plot; made if missing, replaced if it is a simulated plot</source>
      <translation>carpeta para la parcela; se crea si falta, se sustituye si es una parcela simulada</translation>
    </message>
    <message>
      <source>size of the job: micro (3-5 stems, for the stability suite), test (3-6 stems), demo (6-9 stems), plot (0.03 ha, 62 photos)</source>
      <translation>tamaño del trabajo: micro (3-5 troncos, para la serie de estabilidad), test (3-6 troncos), demo (6-9 troncos), plot (0,03 ha, 62 fotos)</translation>
    </message>
    <message>
      <source>Radius [m]</source>
      <translation>Radio [m]</translation>
    </message>
    <message>
      <source>radius of the plot</source>
      <translation>radio de la parcela</translation>
    </message>
    <message>
      <source>planting density</source>
      <translation>densidad de plantación</translation>
    </message>
    <message>
      <source>mean diameter at breast height</source>
      <translation>diámetro medio a la altura del pecho</translation>
    </message>
    <message>
      <source>number of photos, both flights together</source>
      <translation>número de fotos, ambos vuelos juntos</translation>
    </message>
    <message>
      <source>Ground sample distance [cm]</source>
      <translation>Tamaño de píxel en el suelo [cm]</translation>
    </message>
    <message>
      <source>ground sample distance straight down from 70 m; sets the focal length</source>
      <translation>tamaño de píxel en el suelo en vertical desde 70 m; fija la distancia focal</translation>
    </message>
    <message>
      <source>random seed; the same seed gives the same plot</source>
      <translation>semilla; la misma semilla da la misma parcela</translation>
    </message>
    <message>
      <source>the plot's folder</source>
      <translation>la carpeta de la parcela</translation>
    </message>
    <message>
      <source>plot name used in the files</source>
      <translation>nombre de la parcela usado en los archivos</translation>
    </message>
    <message>
      <source>photos rendered</source>
      <translation>fotos generadas</translation>
    </message>
    <message>
      <source>stems inside the plot</source>
      <translation>troncos dentro de la parcela</translation>
    </message>
    <message>
      <source>points of the LiDAR cloud</source>
      <translation>puntos de la nube LiDAR</translation>
    </message>
    <message>
      <source>photos that see a stem's breast height free (median over the stems)</source>
      <translation>fotos que ven despejada la altura del pecho de un tronco (mediana de los troncos)</translation>
    </message>
    <message>
      <source>Check the engine</source>
      <translation>Comprobar el motor</translation>
    </message>
    <message>
      <source>Say what is installed, which steps work and how to install the rest.</source>
      <translation>Dice qué está instalado, qué pasos funcionan y cómo instalar el resto.</translation>
    </message>
    <message>
      <source>Loads every library of the engine, lists versions, cores, memory and disk, and says for each command whether it can run. Ends with an error and one sentence when something is missing.</source>
      <translation>Carga cada biblioteca del motor, lista versiones, núcleos, memoria y disco, y dice de cada orden si puede ejecutarse. Termina con un error y una frase cuando falta algo.</translation>
    </message>
    <message>
      <source>Compile</source>
      <translation>Compilar</translation>
    </message>
    <message>
      <source>Compile now what jobs otherwise compile when they first need it, for this processor; what is compiled already is kept. Setting up the engine does it.</source>
      <translation>Compila ahora lo que los trabajos compilan de otro modo cuando lo necesitan por primera vez, para este procesador; lo ya compilado se conserva. La instalación del motor lo hace.</translation>
    </message>
    <message>
      <source>Python version</source>
      <translation>versión de Python</translation>
    </message>
    <message>
      <source>processor cores</source>
      <translation>núcleos del procesador</translation>
    </message>
    <message>
      <source>memory, GB</source>
      <translation>memoria, GB</translation>
    </message>
    <message>
      <source>free disk for temporary files, GB</source>
      <translation>disco libre para archivos temporales, GB</translation>
    </message>
    <message>
      <source>libraries found</source>
      <translation>bibliotecas encontradas</translation>
    </message>
    <message>
      <source>libraries with versions</source>
      <translation>bibliotecas con versiones</translation>
    </message>
    <message>
      <source>functions compiled now</source>
      <translation>funciones compiladas ahora</translation>
    </message>
    <message>
      <source>in words</source>
      <translation>en palabras</translation>
    </message>
    <message>
      <source>too few photos see the stem at breast height</source>
      <translation>muy pocas fotos ven el tronco a la altura del pecho</translation>
    </message>
    <message>
      <source>fly more oblique photos over this part of the plot</source>
      <translation>tome más fotos oblicuas sobre esta parte de la parcela</translation>
    </message>
    <message>
      <source>foliage or other stems hide the stem at breast height</source>
      <translation>el follaje u otros troncos ocultan el tronco a la altura del pecho</translation>
    </message>
    <message>
      <source>fly leaf-off or from other directions</source>
      <translation>vuele sin hojas o desde otras direcciones</translation>
    </message>
    <message>
      <source>two different stems explain the photos equally well</source>
      <translation>dos troncos distintos explican igual de bien las fotos</translation>
    </message>
    <message>
      <source>check the photos or measure by hand</source>
      <translation>revise las fotos o mida a mano</translation>
    </message>
    <message>
      <source>ivy or other growth covers the bark at breast height</source>
      <translation>hiedra u otra vegetación cubre la corteza a la altura del pecho</translation>
    </message>
    <message>
      <source>measure under it by hand; what is seen is thicker than the stem</source>
      <translation>mida a mano por debajo; lo que se ve es más grueso que el fuste</translation>
    </message>
    <message>
      <source>the bark is seen twice: two dates in one cloud, or scans that do not fit together</source>
      <translation>la corteza se ve dos veces: dos fechas en una nube, o escaneos que no encajan</translation>
    </message>
    <message>
      <source>give the scans of one date, registered to each other</source>
      <translation>dé los escaneos de una fecha, registrados entre sí</translation>
    </message>
    <message>
      <source>photos show the ground, or no bark, where the stem should stand: other things may line up there</source>
      <translation>las fotos muestran el suelo, o ninguna corteza, donde debería estar el tronco: puede que otras cosas queden alineadas allí</translation>
    </message>
    <message>
      <source>look at its photos or on site; there may be no stem</source>
      <translation>mírelo en sus fotos o en el terreno; puede que no haya ningún tronco</translation>
    </message>
    <message>
      <source>the points cover too little of the stem's circumference</source>
      <translation>los puntos cubren muy poco de la circunferencia del tronco</translation>
    </message>
    <message>
      <source>scan or fly from more sides</source>
      <translation>escanee o vuele desde más lados</translation>
    </message>
    <message>
      <source>too few stem points at the lower stem</source>
      <translation>muy pocos puntos en la parte baja del tronco</translation>
    </message>
    <message>
      <source>raise the point density</source>
      <translation>aumente la densidad de puntos</translation>
    </message>
    <message>
      <source>too few slices of the stem gave a circle</source>
      <translation>muy pocas secciones del tronco dieron un círculo</translation>
    </message>
    <message>
      <source>the cross-section is not a circle (buttress, fork or several stems)</source>
      <translation>la sección no es un círculo (contrafuerte, horquilla o varios troncos)</translation>
    </message>
    <message>
      <source>measure by hand</source>
      <translation>mida a mano</translation>
    </message>
    <message>
      <source>diameters along the stem do not form a plausible taper</source>
      <translation>los diámetros a lo largo del tronco no forman un ahusamiento verosímil</translation>
    </message>
    <message>
      <source>check the stem for branches or a fork</source>
      <translation>compruebe si el tronco tiene ramas o una horquilla</translation>
    </message>
    <message>
      <source>the stem leans more than the method allows</source>
      <translation>el tronco se inclina más de lo que admite el método</translation>
    </message>
    <message>
      <source>two stems may have been taken for one</source>
      <translation>dos troncos pueden haberse tomado por uno</translation>
    </message>
    <message>
      <source>check the segmentation</source>
      <translation>revise la segmentación</translation>
    </message>
    <message>
      <source>the stem is thinner than the photos or points can resolve</source>
      <translation>el tronco es más fino de lo que resuelven las fotos o los puntos</translation>
    </message>
    <message>
      <source>fly lower or scan closer</source>
      <translation>vuele más bajo o escanee más cerca</translation>
    </message>
    <message>
      <source>the fitted stem is thicker than the allowed maximum</source>
      <translation>el tronco ajustado es más grueso que el máximo permitido</translation>
    </message>
    <message>
      <source>raise the maximum diameter if it is real</source>
      <translation>suba el diámetro máximo si es real</translation>
    </message>
    <message>
      <source>the tree is far shorter than the others of its diameter</source>
      <translation>el árbol es mucho más bajo que los demás de su diámetro</translation>
    </message>
    <message>
      <source>check the diameter, and whether the top is broken</source>
      <translation>comprobar el diámetro y si la copa está rota</translation>
    </message>
    <message>
      <source>the estimated error is too large to be useful</source>
      <translation>el error estimado es demasiado grande para ser útil</translation>
    </message>
    <message>
      <source>fly more photos or measure by hand</source>
      <translation>tome más fotos o mida a mano</translation>
    </message>
    <message>
      <source>breast height is hidden: measured 2 to 5 m above the ground, carried down by the taper of the plot's stems</source>
      <translation>la altura del pecho está oculta: medido de 2 a 5 m sobre el suelo y llevado hacia abajo con el ahusamiento de los troncos de la parcela</translation>
    </message>
    <message>
      <source>check, or measure by hand where the tenth of a centimetre counts</source>
      <translation>comprobar, o medir a mano donde cuente el milímetro</translation>
    </message>
    <message>
      <source>two measuring methods disagree</source>
      <translation>dos métodos de medición no coinciden</translation>
    </message>
    <message>
      <source>check this tree by hand</source>
      <translation>compruebe este árbol a mano</translation>
    </message>
    <message>
      <source>the published method has no check and no error of its own</source>
      <translation>el método publicado no tiene comprobación ni error propios</translation>
    </message>
    <message>
      <source>compare with the default method</source>
      <translation>compare con el método por defecto</translation>
    </message>
    <message>
      <source>the height of the ground at the tree is unknown or unsure</source>
      <translation>la altura del suelo en el árbol es desconocida o insegura</translation>
    </message>
    <message>
      <source>give the cloud with its ground, or a DTM that fits it</source>
      <translation>dé la nube con su suelo, o un MDT que encaje con ella</translation>
    </message>
    <message>
      <source>the photos of this run hardly fit together: points of some are not found where they must be in others</source>
      <translation>las fotos de esta ejecución apenas encajan entre sí: los puntos de unas no se encuentran donde deben estar en otras</translation>
    </message>
    <message>
      <source>fly with more overlap or in less wind, or check by hand</source>
      <translation>vuele con más solape o con menos viento, o compruebe a mano</translation>
    </message>
    <message>
      <source>the trees are taller than trees of their diameter are: heights may be in feet</source>
      <translation>los árboles son más altos que los de su diámetro: las alturas pueden estar en pies</translation>
    </message>
    <message>
      <source>check the unit of the cloud's heights and measure again</source>
      <translation>compruebe la unidad de las alturas de la nube y mida de nuevo</translation>
    </message>
    <message>
      <source>a person says that a stem stands here, but none was found</source>
      <translation>una persona dice que aquí hay un fuste, pero no se encontró ninguno</translation>
    </message>
    <message>
      <source>measure it at its place in the photos, or by tape</source>
      <translation>medirlo en su lugar en las fotos o con cinta</translation>
    </message>
    <message>
      <source>the tree stands at the edge of the data</source>
      <translation>el árbol está en el borde de los datos</translation>
    </message>
    <message>
      <source>extend the survey beyond the plot</source>
      <translation>amplíe el vuelo más allá de la parcela</translation>
    </message>
    <message>
      <source>Number at the first date</source>
      <translation>Número en la primera fecha</translation>
    </message>
    <message>
      <source>Number at the second date</source>
      <translation>Número en la segunda fecha</translation>
    </message>
    <message>
      <source>Fate</source>
      <translation>Destino</translation>
    </message>
    <message>
      <source>DBH at the first date [cm]</source>
      <translation>DAP en la primera fecha [cm]</translation>
    </message>
    <message>
      <source>DBH at the second date [cm]</source>
      <translation>DAP en la segunda fecha [cm]</translation>
    </message>
    <message>
      <source>Growth [cm]</source>
      <translation>Crecimiento [cm]</translation>
    </message>
    <message>
      <source>Growth, standard error [cm]</source>
      <translation>Crecimiento, error estándar [cm]</translation>
    </message>
    <message>
      <source>Growth, lower end of the interval [cm]</source>
      <translation>Crecimiento, intervalo desde [cm]</translation>
    </message>
    <message>
      <source>Growth, upper end of the interval [cm]</source>
      <translation>Crecimiento, intervalo hasta [cm]</translation>
    </message>
    <message>
      <source>Growth [cm a year]</source>
      <translation>Crecimiento [cm al año]</translation>
    </message>
    <message>
      <source>Growth of basal area [m²]</source>
      <translation>Crecimiento del área basal [m²]</translation>
    </message>
    <message>
      <source>Distance after co-registration [m]</source>
      <translation>Distancia tras el ajuste [m]</translation>
    </message>
    <message>
      <source>Easting [m]</source>
      <translation>Este [m]</translation>
    </message>
    <message>
      <source>Northing [m]</source>
      <translation>Norte [m]</translation>
    </message>
    <message>
      <source>survivor</source>
      <translation>superviviente</translation>
    </message>
    <message>
      <source>ingrowth</source>
      <translation>incorporación</translation>
    </message>
    <message>
      <source>mortality</source>
      <translation>mortalidad</translation>
    </message>
    <message>
      <source>missed before</source>
      <translation>omitido antes</translation>
    </message>
    <message>
      <source>no growth known</source>
      <translation>crecimiento desconocido</translation>
    </message>
    <message>
      <source>unsure</source>
      <translation>inseguro</translation>
    </message>
    <message>
      <source>too small</source>
      <translation>demasiado pequeño</translation>
    </message>
    <message>
      <source>dead</source>
      <translation>muerto</translation>
    </message>
    <message>
      <source>DBH [cm]</source>
      <translation>DAP [cm]</translation>
    </message>
    <message>
      <source>Quality</source>
      <translation>Calidad</translation>
    </message>
    <message>
      <source>Crown area [m²]</source>
      <translation>Área de la copa [m²]</translation>
    </message>
    <message>
      <source>Field DBH [cm]</source>
      <translation>DAP de campo [cm]</translation>
    </message>
    <message>
      <source>Status</source>
      <translation>Estado</translation>
    </message>
    <message>
      <source>Easting, co-registered [m]</source>
      <translation>Este, ajustado [m]</translation>
    </message>
    <message>
      <source>Northing, co-registered [m]</source>
      <translation>Norte, ajustado [m]</translation>
    </message>
    <message>
      <source>Easting as surveyed [m]</source>
      <translation>Este según campo [m]</translation>
    </message>
    <message>
      <source>Northing as surveyed [m]</source>
      <translation>Norte según campo [m]</translation>
    </message>
    <message>
      <source>Paired</source>
      <translation>Emparejado</translation>
    </message>
    <message>
      <source>Measured tree</source>
      <translation>Árbol medido</translation>
    </message>
    <message>
      <source>paired</source>
      <translation>emparejado</translation>
    </message>
    <message>
      <source>not paired</source>
      <translation>sin pareja</translation>
    </message>
    <message>
      <source>plot needs a hand check</source>
      <translation>parcela por revisar a mano</translation>
    </message>
    <message>
      <source>pair rejected</source>
      <translation>par rechazado</translation>
    </message>
    <message>
      <source>not searched there</source>
      <translation>allí no se buscó</translation>
    </message>
    <message>
      <source>Measured DBH [cm]</source>
      <translation>DAP medido [cm]</translation>
    </message>
    <message>
      <source>DBH as measured [cm]</source>
      <translation>DAP medido [cm]</translation>
    </message>
    <message>
      <source>Decision</source>
      <translation>Decisión</translation>
    </message>
    <message>
      <source>In the plot's circle</source>
      <translation>Dentro del círculo de la parcela</translation>
    </message>
    <message>
      <source>Measured - field DBH [cm]</source>
      <translation>DAP medido - de campo [cm]</translation>
    </message>
    <message>
      <source>DBH, lower end of 90 % interval [cm]</source>
      <translation>DAP, extremo inferior del intervalo del 90 % [cm]</translation>
    </message>
    <message>
      <source>DBH, upper end of 90 % interval [cm]</source>
      <translation>DAP, extremo superior del intervalo del 90 % [cm]</translation>
    </message>
    <message>
      <source>Log-odds against the next best pairing</source>
      <translation>Log-probabilidad frente al siguiente mejor emparejamiento</translation>
    </message>
    <message>
      <source>Pair status</source>
      <translation>Estado del par</translation>
    </message>
    <message>
      <source>Note</source>
      <translation>Nota</translation>
    </message>
    <message>
      <source>below -4 cm</source>
      <translation>menos de -4 cm</translation>
    </message>
    <message>
      <source>-4 to -2 cm</source>
      <translation>de -4 a -2 cm</translation>
    </message>
    <message>
      <source>within 2 cm</source>
      <translation>dentro de 2 cm</translation>
    </message>
    <message>
      <source>2 to 4 cm</source>
      <translation>de 2 a 4 cm</translation>
    </message>
    <message>
      <source>above 4 cm</source>
      <translation>más de 4 cm</translation>
    </message>
    <message>
      <source>Your decision</source>
      <translation>Su decisión</translation>
    </message>
    <message>
      <source>The two trees</source>
      <translation>Los dos árboles</translation>
    </message>
    <message>
      <source>automatic</source>
      <translation>automático</translation>
    </message>
    <message>
      <source>confirmed</source>
      <translation>confirmado</translation>
    </message>
    <message>
      <source>moved by hand</source>
      <translation>movido a mano</translation>
    </message>
    <message>
      <source>Ground sample distance in the middle [cm]</source>
      <translation>Resolución en el suelo en el centro [cm]</translation>
    </message>
    <message>
      <source>Line</source>
      <translation>Línea</translation>
    </message>
    <message>
      <source>Yaw, grid north [°]</source>
      <translation>Guiñada, norte de cuadrícula [°]</translation>
    </message>
    <message>
      <source>Yaw, true north [°]</source>
      <translation>Guiñada, norte verdadero [°]</translation>
    </message>
    <message>
      <source>Pitch [°]</source>
      <translation>Cabeceo [°]</translation>
    </message>
    <message>
      <source>Height, datum of the terrain model [m]</source>
      <translation>Altura, datum del modelo del terreno [m]</translation>
    </message>
    <message>
      <source>Height above take-off [m]</source>
      <translation>Altura sobre el despegue [m]</translation>
    </message>
    <message>
      <source>Height above ground [m]</source>
      <translation>Altura sobre el suelo [m]</translation>
    </message>
    <message>
      <source>Speed to the next photo [m/s]</source>
      <translation>Velocidad hasta la foto siguiente [m/s]</translation>
    </message>
    <message>
      <source>Stems it is expected to show clearly</source>
      <translation>Fustes que se espera que muestre libres</translation>
    </message>
    <message>
      <source>Photo width [px]</source>
      <translation>Ancho de la foto [px]</translation>
    </message>
    <message>
      <source>Photo height [px]</source>
      <translation>Alto de la foto [px]</translation>
    </message>
    <message>
      <source>Focal length [px]</source>
      <translation>Distancia focal [px]</translation>
    </message>
    <message>
      <source>oblique</source>
      <translation>oblicua</translation>
    </message>
    <message>
      <source>straight down</source>
      <translation>vertical hacia abajo</translation>
    </message>
    <message>
      <source>Stems expected</source>
      <translation>Fustes esperados</translation>
    </message>
    <message>
      <source>Clear views a stem expected</source>
      <translation>Vistas libres esperadas por fuste</translation>
    </message>
    <message>
      <source>Share of the stems with a DBH expected</source>
      <translation>Proporción esperada de los fustes con DAP</translation>
    </message>
    <message>
      <source>Standard error of DBH expected, median [cm]</source>
      <translation>Error estándar esperado del DAP, mediana [cm]</translation>
    </message>
    <message>
      <source>Photos that show it</source>
      <translation>Fotos que la muestran</translation>
    </message>
    <message>
      <source>below 60 %</source>
      <translation>menos del 60 %</translation>
    </message>
    <message>
      <source>60 to 85 %</source>
      <translation>60 a 85 %</translation>
    </message>
    <message>
      <source>85 % and more</source>
      <translation>85 % y más</translation>
    </message>
    <message>
      <source>Reason</source>
      <translation>Motivo</translation>
    </message>
    <message>
      <source>Moved east [m]</source>
      <translation>Movida al este [m]</translation>
    </message>
    <message>
      <source>Moved north [m]</source>
      <translation>Movida al norte [m]</translation>
    </message>
    <message>
      <source>Turned clockwise [°]</source>
      <translation>Girada en sentido horario [°]</translation>
    </message>
    <message>
      <source>Score over the next best placing</source>
      <translation>Puntuación sobre la siguiente mejor colocación</translation>
    </message>
    <message>
      <source>Log-likelihood over the next best placing</source>
      <translation>Log-verosimilitud sobre la siguiente mejor colocación</translation>
    </message>
    <message>
      <source>Residual of the pairs [m]</source>
      <translation>Residuo de los pares [m]</translation>
    </message>
    <message>
      <source>Share of trees with a partner within 1 m</source>
      <translation>Parte de los árboles con pareja a menos de 1 m</translation>
    </message>
    <message>
      <source>Measured trees in the circle</source>
      <translation>Árboles medidos en el círculo</translation>
    </message>
    <message>
      <source>Suggestions</source>
      <translation>Propuestas</translation>
    </message>
    <message>
      <source>Easting of the centre, co-registered [m]</source>
      <translation>Este del centro, ajustado [m]</translation>
    </message>
    <message>
      <source>Northing of the centre, co-registered [m]</source>
      <translation>Norte del centro, ajustado [m]</translation>
    </message>
    <message>
      <source>placed</source>
      <translation>colocada</translation>
    </message>
    <message>
      <source>confirmed by hand</source>
      <translation>confirmada a mano</translation>
    </message>
    <message>
      <source>needs a hand check</source>
      <translation>por revisar a mano</translation>
    </message>
    <message>
      <source>Easting of the middle [m]</source>
      <translation>Este del centro [m]</translation>
    </message>
    <message>
      <source>Northing of the middle [m]</source>
      <translation>Norte del centro [m]</translation>
    </message>
    <message>
      <source>Area searched [m²]</source>
      <translation>Superficie buscada [m²]</translation>
    </message>
    <message>
      <source>Share of the plot searched</source>
      <translation>Parte buscada de la parcela</translation>
    </message>
    <message>
      <source>Day of the photos or points</source>
      <translation>Día de las fotos o de los puntos</translation>
    </message>
    <message>
      <source>Diameter [cm]</source>
      <translation>Diámetro [cm]</translation>
    </message>
    <message>
      <source>Diameter standard error [cm]</source>
      <translation>Error estándar del diámetro [cm]</translation>
    </message>
    <message>
      <source>Roughness, rms [cm]</source>
      <translation>Rugosidad, rms [cm]</translation>
    </message>
    <message>
      <source>Points</source>
      <translation>Puntos</translation>
    </message>
    <message>
      <source>Circumference seen [°]</source>
      <translation>Circunferencia vista [°]</translation>
    </message>
    <message>
      <source>0 to 2 m above ground</source>
      <translation>de 0 a 2 m sobre el suelo</translation>
    </message>
    <message>
      <source>2 to 5 m above ground</source>
      <translation>de 2 a 5 m sobre el suelo</translation>
    </message>
    <message>
      <source>5 to 10 m above ground</source>
      <translation>de 5 a 10 m sobre el suelo</translation>
    </message>
    <message>
      <source>10 to 15 m above ground</source>
      <translation>de 10 a 15 m sobre el suelo</translation>
    </message>
    <message>
      <source>15 to 60 m above ground</source>
      <translation>de 15 a 60 m sobre el suelo</translation>
    </message>
    <message>
      <source>Shape</source>
      <translation>Forma</translation>
    </message>
    <message>
      <source>Edge of the stand</source>
      <translation>Borde del rodal</translation>
    </message>
    <message>
      <source>Area [ha]</source>
      <translation>Superficie [ha]</translation>
    </message>
    <message>
      <source>Trees per hectare that one tree stands for</source>
      <translation>Árboles por hectárea que representa un árbol</translation>
    </message>
    <message>
      <source>Dead trees</source>
      <translation>Árboles muertos</translation>
    </message>
    <message>
      <source>Trees per hectare</source>
      <translation>Árboles por hectárea</translation>
    </message>
    <message>
      <source>Basal area [m²/ha]</source>
      <translation>Área basal [m²/ha]</translation>
    </message>
    <message>
      <source>Quadratic mean diameter [cm]</source>
      <translation>Diámetro medio cuadrático [cm]</translation>
    </message>
    <message>
      <source>Lorey's mean height [m]</source>
      <translation>Altura media de Lorey [m]</translation>
    </message>
    <message>
      <source>Dominant height [m]</source>
      <translation>Altura dominante [m]</translation>
    </message>
    <message>
      <source>Volume [m³/ha]</source>
      <translation>Volumen [m³/ha]</translation>
    </message>
    <message>
      <source>Biomass above ground [t/ha]</source>
      <translation>Biomasa aérea [t/ha]</translation>
    </message>
    <message>
      <source>Counts as</source>
      <translation>Cuenta como</translation>
    </message>
    <message>
      <source>Height [m]</source>
      <translation>Altura [m]</translation>
    </message>
    <message>
      <source>Height from</source>
      <translation>Origen de la altura</translation>
    </message>
    <message>
      <source>Weight</source>
      <translation>Peso</translation>
    </message>
    <message>
      <source>Trees per hectare it stands for</source>
      <translation>Árboles por hectárea que representa</translation>
    </message>
    <message>
      <source>Basal area [m²]</source>
      <translation>Área basal [m²]</translation>
    </message>
    <message>
      <source>Volume [m³]</source>
      <translation>Volumen [m³]</translation>
    </message>
    <message>
      <source>Biomass above ground [kg]</source>
      <translation>Biomasa aérea [kg]</translation>
    </message>
    <message>
      <source>Reasons</source>
      <translation>Motivos</translation>
    </message>
    <message>
      <source>File</source>
      <translation>Archivo</translation>
    </message>
    <message>
      <source>Position quality</source>
      <translation>Calidad de la posición</translation>
    </message>
    <message>
      <source>Standard deviation east [m]</source>
      <translation>Desviación estándar este [m]</translation>
    </message>
    <message>
      <source>Standard deviation north [m]</source>
      <translation>Desviación estándar norte [m]</translation>
    </message>
    <message>
      <source>Standard deviation up [m]</source>
      <translation>Desviación estándar vertical [m]</translation>
    </message>
    <message>
      <source>Exposure (UTC)</source>
      <translation>Disparo (UTC)</translation>
    </message>
    <message>
      <source>Exposure (UTC) [s since 1970]</source>
      <translation>Disparo (UTC) [s desde 1970]</translation>
    </message>
    <message>
      <source>Flight</source>
      <translation>Vuelo</translation>
    </message>
    <message>
      <source>Yaw [°]</source>
      <translation>Rumbo [°]</translation>
    </message>
    <message>
      <source>Roll [°]</source>
      <translation>Alabeo [°]</translation>
    </message>
    <message>
      <source>Velocity east [m/s]</source>
      <translation>Velocidad este [m/s]</translation>
    </message>
    <message>
      <source>Velocity north [m/s]</source>
      <translation>Velocidad norte [m/s]</translation>
    </message>
    <message>
      <source>Velocity up [m/s]</source>
      <translation>Velocidad vertical [m/s]</translation>
    </message>
    <message>
      <source>Source of the velocity</source>
      <translation>Origen de la velocidad</translation>
    </message>
    <message>
      <source>fixed (centimetres)</source>
      <translation>fija (centímetros)</translation>
    </message>
    <message>
      <source>float (decimetres)</source>
      <translation>flotante (decímetros)</translation>
    </message>
    <message>
      <source>single (metres)</source>
      <translation>simple (metros)</translation>
    </message>
    <message>
      <source>from the photo (metres)</source>
      <translation>de la foto (metros)</translation>
    </message>
    <message>
      <source>unknown</source>
      <translation>desconocida</translation>
    </message>
    <message>
      <source>Taped DBH [cm]</source>
      <translation>DAP con cinta [cm]</translation>
    </message>
    <message>
      <source>Measured - taped DBH [cm]</source>
      <translation>DAP medido - cinta [cm]</translation>
    </message>
    <message>
      <source>Tape inside the interval</source>
      <translation>Cinta dentro del intervalo</translation>
    </message>
    <message>
      <source>State</source>
      <translation>Estado</translation>
    </message>
    <message>
      <source>Look again</source>
      <translation>Mirar otra vez</translation>
    </message>
    <message>
      <source>Place in the walk</source>
      <translation>Lugar en el recorrido</translation>
    </message>
    <message>
      <source>Second tape [cm]</source>
      <translation>Segunda cinta [cm]</translation>
    </message>
    <message>
      <source>Drawn tree beside it</source>
      <translation>Árbol sorteado al lado</translation>
    </message>
    <message>
      <source>Measured DBH, about [cm]</source>
      <translation>DAP medido, aproximado [cm]</translation>
    </message>
    <message>
      <source>Bearing from the centre [°]</source>
      <translation>Rumbo desde el centro [°]</translation>
    </message>
    <message>
      <source>Distance from the centre [m]</source>
      <translation>Distancia desde el centro [m]</translation>
    </message>
    <message>
      <source>Longitude [°]</source>
      <translation>Longitud [°]</translation>
    </message>
    <message>
      <source>Latitude [°]</source>
      <translation>Latitud [°]</translation>
    </message>
    <message>
      <source>Stratum</source>
      <translation>Estrato</translation>
    </message>
    <message>
      <source>Chance of being drawn</source>
      <translation>Probabilidad del sorteo</translation>
    </message>
    <message>
      <source>Trees that were drawn from</source>
      <translation>Árboles entre los que se sorteó</translation>
    </message>
    <message>
      <source>Design</source>
      <translation>Diseño</translation>
    </message>
    <message>
      <source>Mark of the list</source>
      <translation>Marca de la lista</translation>
    </message>
    <message>
      <source>to tape</source>
      <translation>por medir</translation>
    </message>
    <message>
      <source>no tree there</source>
      <translation>no hay árbol</translation>
    </message>
    <message>
      <source>not reached</source>
      <translation>no alcanzado</translation>
    </message>
    <message>
      <source>Filled in by the crew</source>
      <translation>Rellenado por la cuadrilla</translation>
    </message>
    <message>
      <source>Drawn tree</source>
      <translation>Árbol sorteado</translation>
    </message>
    <message>
      <source>none (no tree there)</source>
      <translation>none (no hay árbol)</translation>
    </message>
    <message>
      <source>Easting at breast height [m]</source>
      <translation>Este a la altura del pecho [m]</translation>
    </message>
    <message>
      <source>Northing at breast height [m]</source>
      <translation>Norte a la altura del pecho [m]</translation>
    </message>
    <message>
      <source>Ground height [m]</source>
      <translation>Altura del suelo [m]</translation>
    </message>
    <message>
      <source>Breast height used [m]</source>
      <translation>Altura del pecho usada [m]</translation>
    </message>
    <message>
      <source>Tree height, standard error [m]</source>
      <translation>Altura del árbol, error estándar [m]</translation>
    </message>
    <message>
      <source>Why there is no height</source>
      <translation>Por qué no hay altura</translation>
    </message>
    <message>
      <source>Lean [°]</source>
      <translation>Inclinación [°]</translation>
    </message>
    <message>
      <source>Stem circumference seen [°]</source>
      <translation>Circunferencia del tronco vista [°]</translation>
    </message>
    <message>
      <source>Stem points</source>
      <translation>Puntos del tronco</translation>
    </message>
    <message>
      <source>Photos that see the stem</source>
      <translation>Fotos que ven el tronco</translation>
    </message>
    <message>
      <source>Slices fitted</source>
      <translation>Secciones ajustadas</translation>
    </message>
    <message>
      <source>Mean opacity (0-1)</source>
      <translation>Opacidad media (0-1)</translation>
    </message>
    <message>
      <source>Taper [cm/m]</source>
      <translation>Ahusamiento [cm/m]</translation>
    </message>
    <message>
      <source>Run</source>
      <translation>Ejecución</translation>
    </message>
    <message>
      <source>Live or dead</source>
      <translation>Vivo o muerto</translation>
    </message>
    <message>
      <source>Why</source>
      <translation>Por qué</translation>
    </message>
    <message>
      <source>Decided by</source>
      <translation>Decidido por</translation>
    </message>
    <message>
      <source>Decided at (UTC)</source>
      <translation>Decidido el (UTC)</translation>
    </message>
    <message>
      <source>seen, no DBH</source>
      <translation>visto, sin DAP</translation>
    </message>
    <message>
      <source>by hand: accepted, taped</source>
      <translation>a mano: aceptado, medido</translation>
    </message>
    <message>
      <source>by hand: no DBH</source>
      <translation>a mano: sin DAP</translation>
    </message>
    <message>
      <source>by hand: no tree</source>
      <translation>a mano: ningún árbol</translation>
    </message>
    <message>
      <source>pale: outside the plots</source>
      <translation>pálido: fuera de las parcelas</translation>
    </message>
    <message>
      <source>Yours to write</source>
      <translation>Para escribir usted</translation>
    </message>
    <message>
      <source>Measured</source>
      <translation>Medido</translation>
    </message>
    <message>
      <source>not said</source>
      <translation>sin indicar</translation>
    </message>
    <message>
      <source>live</source>
      <translation>vivo</translation>
    </message>
    <message>
      <source>not decided</source>
      <translation>sin decidir</translation>
    </message>
  </context>
</TS>
